from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cohaptic_server.mesh.tetrahedra import TetMesh, boundary
from cohaptic_server.mesh.thin_parts import (
    FADES,
    SHORT,
    THIN,
    finer_where_thin,
    layer_thickness,
    longest_wanted,
)
from cohaptic_server.numeric import Floats
from cohaptic_server.testing.blocks import block
from tests.examples_of_laws import examples

LENGTH = 0.01  # m


def plate(thickness: float) -> TetMesh:
    return block((0.1, 0.08, thickness), (10, 8, 1))


def turned(x: Floats, turn: float) -> Floats:
    c, s = np.cos(turn), np.sin(turn)
    return np.asarray(x @ np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]).T[:, [2, 0, 1]])


@given(st.floats(1e-4, 4.0 * THIN * LENGTH), st.floats(0.0, 2.0 * np.pi))
@settings(max_examples=examples(40), deadline=None)
def test_a_plate_has_its_thickness_up_to_the_most(thickness: float, turn: float) -> None:
    mesh, limit = plate(thickness), THIN * LENGTH
    found = layer_thickness(turned(mesh.vertices, turn), boundary(mesh.tets), limit)
    if thickness < 0.99 * limit:
        assert found == pytest.approx(thickness, rel=1e-6)
    if thickness > 1.01 * limit:
        assert np.isinf(found).all()


@given(st.floats(1e-7, 1.0), st.floats(1.0, 1.5), st.floats(1e-3, 1e3))
def test_edges_are_the_shorter_the_thinner_a_part_is_down_to_a_share(
    thickness: float, thicker: float, scale: float
) -> None:
    t = np.array([thickness, thicker * thickness, np.inf])
    h = longest_wanted(t, LENGTH)
    assert h[0] <= h[1] * (1.0 + 1e-12)
    assert h[0] >= 0.3 * SHORT * LENGTH
    assert np.isinf(h[2])
    # A file in other units is the same object.
    assert longest_wanted(scale * t, scale * LENGTH) == pytest.approx(scale * h)


@given(st.floats(0.0, 2.0 * np.pi), st.floats(0.2, 3.0))
@settings(max_examples=examples(20), deadline=None)
def test_a_gap_is_not_thin_and_what_is_beside_it_neither(angle: float, gap: float) -> None:
    """Two cubes, 4 edges wide, whose faces look at each other across a narrow gap."""
    cube = block((0.04, 0.04, 0.04), (4, 4, 4))
    n = len(cube.vertices)
    other = cube.vertices + np.array([0.04 + gap * 1e-3, 0.0, 0.0])
    x = np.concatenate([cube.vertices, other])
    c, s = np.cos(angle), np.sin(angle)
    x = x @ np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    faces = boundary(cube.tets)
    faces = np.concatenate([faces, faces + n])
    assert np.isinf(layer_thickness(x, faces, FADES * THIN * LENGTH)).all()


def test_only_the_thin_part_is_made_finer() -> None:
    """A block with a plate that grows out of it."""
    mesh = block((0.16, 0.04, 0.04), (16, 4, 4))
    low = (mesh.vertices[mesh.tets].mean(axis=1) @ [0.0, 0.0, 1.0]) < 0.01
    thick = mesh.vertices[mesh.tets].mean(axis=1)[:, 0] < np.median(mesh.vertices[:, 0])
    part = TetMesh.checked(mesh.vertices, mesh.tets[low | thick])
    found = finer_where_thin(part, LENGTH, 10**6)
    counts = np.bincount(found.parent, minlength=len(part.tets))
    # Elements beside the end of the plate are split with those of the plate.
    x = part.vertices[part.tets].mean(axis=1)[:, 0]
    middle = np.median(mesh.vertices[:, 0])
    assert (counts[x < middle - 2.0 * LENGTH] == 1).all()
    assert (counts[x > middle] > 1).all()
    assert found.excess == 1.0
