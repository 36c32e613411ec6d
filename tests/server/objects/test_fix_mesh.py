from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from cohaptic.errors import BodyError, SettingError
from cohaptic_server.mesh.icosphere import icosphere
from cohaptic_server.objects import fix_rule
from cohaptic_server.objects.fix_rule import fixed_vertices, fixed_within, inside, read_fix_mesh
from cohaptic_server.objects.object_file import ObjectFile
from cohaptic_server.testing.blocks import block
from tests.examples_of_laws import examples
from tests.server.objects.files import write

X = block((0.1, 0.1, 0.1), (5, 5, 5)).vertices


@given(st.integers(0, 2**32 - 1), st.booleans())
@settings(max_examples=examples(20), deadline=None)
def test_inside_a_ball_is_what_is_nearer_than_its_radius(seed: int, turned: bool) -> None:
    rng = np.random.default_rng(seed)
    y, faces = icosphere(3, 1.0)
    center = rng.normal(size=3)
    x = center + rng.uniform(-1.5, 1.5, (300, 3))
    r = np.linalg.norm(x - center, axis=1)
    sure = (r < 0.98) | (r > 1.0)  # between them lie the facets
    found = inside(y + center, faces[:, ::-1] if turned else faces, x)
    assert np.array_equal(found[sure], (r < 1.0)[sure])


def test_a_tube_is_not_inside_of_a_ring_that_it_goes_through() -> None:
    ring = trimesh.creation.torus(1.0, 0.3)  # pyright: ignore[reportUnknownMemberType]
    x = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, -1.0, 0.1], [0.0, 0.5, 0.0]])
    found = inside(np.asarray(ring.vertices), np.asarray(ring.faces, dtype=np.int64), x)
    assert found.tolist() == [False, True, True, False]


def test_a_second_surface_holds_what_lies_in_it(tmp_path: Path) -> None:
    y, faces = icosphere(2, 40.0)
    path = write(tmp_path / "bone.stl", y, faces)
    wanted = ObjectFile(tmp_path / "block.stl", scale=0.001, fix_mesh=path)
    held = fixed_vertices(wanted, X)
    r = np.linalg.norm(X, axis=1)
    assert held[r < 0.037].all()
    assert not held[r > 0.04].any()
    with pytest.raises(SettingError, match="given without --fix"):
        fixed_vertices(replace(wanted, fix="z < 10%"), X)


def held_within(path: Path) -> npt.NDArray[np.bool_]:
    return fixed_within(path, *read_fix_mesh(path, 1.0), X)


def test_a_surface_that_cannot_hold_says_why(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    y, faces = icosphere(1, 0.03)
    with pytest.raises(BodyError, match="there is no such file"):
        read_fix_mesh(tmp_path / "none.stl", 1.0)
    with pytest.raises(BodyError, match="not closed: 3 of its edges do not have two triangles"):
        held_within(write(tmp_path / "open.stl", y, faces[1:]))
    with pytest.raises(SettingError, match=r"float away; it has x 0.97 to 1.03 m, .*the object"):
        held_within(write(tmp_path / "far.stl", y + 1.0, faces))
    with pytest.raises(SettingError, match="leaves something free to move"):
        held_within(write(tmp_path / "all.stl", 10.0 * y, faces))
    monkeypatch.setattr(fix_rule, "MAX_FIX_TRIANGLES", 79)
    with pytest.raises(BodyError, match="80 triangles; to say what is held 79 must do"):
        held_within(write(tmp_path / "fine.stl", y, faces))
