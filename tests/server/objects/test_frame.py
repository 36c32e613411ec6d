"""An object is served about its middle, and the frame of its file is kept."""

from __future__ import annotations

import contextlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cohaptic.errors import BodyError
from cohaptic.protocol.frame import MAX_POSITION
from cohaptic_server.bodies.solid.shape import SolidSettings
from cohaptic_server.bodies.solid.solid import Solid
from cohaptic_server.bodies.touched_body import TouchedBody
from cohaptic_server.mesh.tetrahedra import TetMesh
from cohaptic_server.objects.build import build_solid
from cohaptic_server.objects.checked_cells import FARTHEST, FARTHEST_SINGLE, checked_cells
from cohaptic_server.objects.object_file import ObjectFile
from cohaptic_server.room.body_frames import BodyFrames, describe
from cohaptic_server.testing.blocks import block
from tests.examples_of_laws import examples
from tests.server.objects.files import write

meshio: Any = pytest.importorskip("meshio", reason="pip install 'cohaptic[objects]' reads volumes")

BLOCK = block((0.06, 0.06, 0.06), (3, 3, 3))
FAR = st.floats(-1e6, 1e6, allow_nan=False)


def moved(path: Path, by: tuple[float, float, float], fix: str = "x <= 0%") -> ObjectFile:
    """A block in a file, `by` away from where the others lie."""
    meshio.Mesh(BLOCK.vertices + np.array(by), [("tetra", BLOCK.tets)]).write(path)
    return ObjectFile(path, fix, material=SolidSettings(order=1))


def in_file(body: Solid) -> np.ndarray[Any, np.dtype[np.float64]]:
    return np.asarray(body.mesh.vertices + np.array(body.mesh.origin))


@given(FAR, FAR, FAR)
@settings(max_examples=examples(40))
def test_a_mesh_is_centred_to_a_tenth_of_its_size_and_keeps_its_place(
    x: float, y: float, z: float
) -> None:
    tets = TetMesh(BLOCK.vertices + np.array((x, y, z)), BLOCK.tets)
    centred = tets.centred()
    low, high = centred.vertices.min(axis=0), centred.vertices.max(axis=0)
    digits = 4.0 * np.spacing(np.abs((x, y, z)).max() + 1.0)
    assert 0.5 * np.abs(low + high).max() <= 0.0005 + digits  # half a power of ten below 6 mm
    back = centred.vertices + np.array(centred.origin)
    assert np.abs(back - tets.vertices).max() <= digits
    assert centred.tets is tets.tets


@pytest.mark.parametrize(
    "by", [(0.0, 0.0, 0.0), (9.95, 0.0, 0.0), (12.0, -3.0, 0.5), (5e5, -2e5, 0.0)]
)
def test_an_object_is_the_same_wherever_it_lies_in_its_file(
    by: tuple[float, float, float], tmp_path: Path
) -> None:
    here = build_solid(moved(tmp_path / "here.vtu", (0.0, 0.0, 0.0)))
    there = build_solid(moved(tmp_path / "there.vtu", by))
    digits = 1e-15 * (1.0 + np.abs(by).max())
    assert np.abs(in_file(there) - in_file(here) - np.array(by)).max() <= 4.0 * digits
    # Every digit of a coordinate counts a thousand times in a compliance.
    wanted = here.vertex_compliance()
    found = there.vertex_compliance()
    assert np.abs(found - wanted).max() <= (1e-9 + 1e4 * digits) * wanted.max()
    about = describe(there)
    assert np.abs(about.center).max() <= 0.0005
    assert about.to_file(about.center) == pytest.approx(
        np.array(by) + 0.5 * (BLOCK.vertices.min(axis=0) + BLOCK.vertices.max(axis=0)), rel=1e-12
    )
    frames = BodyFrames(TouchedBody(there))
    assert frames.touch_mesh()
    assert frames.rest_mesh()


@pytest.mark.parametrize(
    ("lengths", "single", "said"),
    [
        (0.9 * FARTHEST_SINGLE, True, ""),
        (1.1 * FARTHEST_SINGLE, True, r"its numbers in single precision do not tell its points"),
        (0.9 * FARTHEST, False, ""),
        (1.1 * FARTHEST, False, r"its numbers do not tell its points apart there"),
    ],
)
def test_an_object_without_digits_for_its_own_shape_is_refused(
    lengths: float, single: bool, said: str
) -> None:
    x = BLOCK.vertices + np.array((0.06 * lengths, 0.0, 0.0))
    x = x.astype(np.float32).astype(np.float64) if single else x
    refused = pytest.raises(BodyError, match=said) if said else contextlib.nullcontext()
    with refused:
        checked_cells(Path("far.ply"), x, BLOCK.tets)


@pytest.mark.live
@pytest.mark.parametrize("away", [2.0 * MAX_POSITION, 5e5])
def test_a_surface_far_from_its_origin_is_filled_whole(away: float, tmp_path: Path) -> None:
    """At 5e5 m fTetWild lost a quarter of a ball."""
    trimesh: Any = pytest.importorskip("trimesh")
    ball = trimesh.creation.icosphere(2, 0.05)
    path = write(tmp_path / "ball.off", ball.vertices + np.array((away, 0.0, -away)), ball.faces)
    source = ObjectFile(path, "y < 10%", edge=0.15, material=SolidSettings(order=1))
    solid = build_solid(source)
    assert solid.shape.tets.volume == pytest.approx(ball.volume, rel=0.02)
    assert solid.mesh.origin == pytest.approx((away, 0.0, -away), abs=1e-3)
