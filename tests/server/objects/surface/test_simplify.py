from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from cohaptic.errors import BodyError
from cohaptic_server.mesh.enclosed_volume import volume
from cohaptic_server.mesh.icosphere import icosphere
from cohaptic_server.numeric import Floats, Ints
from cohaptic_server.objects import prepare as prepare_module
from cohaptic_server.objects.object_file import ObjectFile
from cohaptic_server.objects.parts import surfaces as parts_surfaces
from cohaptic_server.objects.prepare import prepare
from cohaptic_server.objects.surface import accept
from cohaptic_server.objects.surface.checks import examine
from cohaptic_server.objects.surface.simplify import (
    _collapsed,  # pyright: ignore[reportPrivateUsage]
    count_triangles,
    simplify,
)
from tests.server.objects.files import write

BALL = icosphere(3, 0.05)


@pytest.mark.parametrize("kind", ["stl", "stl_ascii", "ply", "obj", "off", "glb"])
def test_triangles_are_counted_without_reading_them(kind: str, tmp_path: Path) -> None:
    path = tmp_path / f"ball.{kind[:3]}"
    mesh: Any = trimesh.Trimesh(*BALL, process=False)
    mesh.export(path, file_type=kind)
    assert count_triangles(path) == len(BALL[1])


@pytest.mark.parametrize("kind", ["stl", "ply", "obj", "off", "glb", "3mf"])
@pytest.mark.parametrize("content", [b"", b"OFF", b"a poem", bytes(200), b"glTF" * 40])
def test_what_is_no_mesh_has_none(kind: str, content: bytes, tmp_path: Path) -> None:
    path = tmp_path / f"a.{kind}"
    path.write_bytes(content)
    assert count_triangles(path) == 0


def test_millions_are_refused_before_they_are_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "scan.stl"
    with path.open("wb") as file:  # a hole of 250 MB, which takes no room
        file.write(bytes(80) + (5_000_000).to_bytes(4, "little"))
        file.truncate(84 + 50 * 5_000_000)

    def read(path: Path) -> None:
        raise AssertionError(f"{path} was read")

    monkeypatch.setattr(prepare_module, "read_surfaces", read)
    said = r"5,000,000 triangles; the limit is 300,000, .* about 2\.8 hours\. .*--simplify 20000"
    with pytest.raises(BodyError, match=said):
        prepare(ObjectFile(path, "z < 10%"))


@pytest.mark.live
def test_at_the_users_word_they_are_simplified(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("fast_simplification", reason="pip install 'cohaptic[objects]'")
    pytest.importorskip("pytetwild", reason="pip install 'cohaptic[objects]' fills surfaces")
    monkeypatch.setattr(prepare_module, "MAX_TRIANGLES", 1000)
    monkeypatch.setattr(accept, "MAX_TRIANGLES", 1000)
    path = tmp_path / "ball.stl"
    mesh: Any = trimesh.Trimesh(*BALL, process=False)
    mesh.export(path)
    with pytest.raises(BodyError, match="1,280 triangles; the limit is 1,000"):
        prepare(ObjectFile(path, edge=0.2))
    made = prepare(ObjectFile(path, edge=0.2, simplify=400))
    assert made.triangles == 1280
    assert made.simplified == pytest.approx(400, abs=10)
    assert made.tets.volume == pytest.approx(volume(*BALL), rel=0.05)
    assert prepare(ObjectFile(path, edge=0.2, simplify=1000)).simplified <= 1000


@pytest.mark.parametrize("count", [2000, 4000])
def test_a_clean_surface_stays_clean(count: int) -> None:
    """In haste a noisy ball folds onto itself."""
    x, faces = icosphere(5, 0.05)
    out = np.random.default_rng(0).normal(1.0, 0.01, len(x))
    x = x * out[:, None]
    assert not examine(x, faces).problems()
    hasty = _collapsed(x, faces, count, 7)
    assert examine(*hasty).problems(), "the default would do"
    found = simplify(x, faces, count)
    assert len(found[1]) <= 1.2 * count
    before, after = (examine(*one) for one in (hasty, found))
    assert after.intersecting + after.nonmanifold_edges < 0.5 * (
        before.intersecting + before.nonmanifold_edges
    )


def test_what_simplifying_leaves_encloses_a_volume(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Triangles that lie on each other once kept an edge, and all others collapsed into a plane."""

    def collapsed(x: Floats, faces: Ints, count: int) -> tuple[Floats, Ints]:
        return x * [1.0, 1.0, 0.0], faces[:count]

    monkeypatch.setattr(parts_surfaces, "simplify", collapsed)
    path = write(tmp_path / "ball.stl", *BALL)
    with pytest.raises(BodyError, match=r"ball.stl: 900 triangles leave nothing of it .* --simpli"):
        prepare(ObjectFile(path, simplify=900, repair=True))
