from __future__ import annotations

import numpy as np
import pytest

from cohaptic_server.mesh.surface import SurfaceMesh
from cohaptic_server.mesh.tetrahedra import TetMesh, boundary
from cohaptic_server.mesh.thin_parts import depth_under, is_smooth, thickness
from cohaptic_server.testing.blocks import block
from cohaptic_tools.inspection.inspection import quality

REGULAR = np.array([[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]])


def test_a_regular_tetrahedron_is_the_measure() -> None:
    found = quality(TetMesh.checked(REGULAR, np.array([[0, 1, 2, 3]])))
    angle = np.degrees(np.arccos(1.0 / 3.0))
    assert [found.min_dihedral, found.max_dihedral] == pytest.approx([angle, angle])
    assert [found.median_ratio, found.min_ratio, found.slivers] == pytest.approx([1.0, 1.0, 0.0])


def test_a_flat_one_is_found_among_good_ones() -> None:
    flat = REGULAR * np.array([1.0, 1.0, 0.01]) + np.array([5.0, 0.0, 0.0])
    joined = np.concatenate([REGULAR, flat[1:]])
    tets = np.array([[0, 1, 2, 3], [0, 4, 5, 6]])
    found = quality(TetMesh.checked(joined, tets))
    assert found.min_ratio < 0.3
    good = quality(block((1.0, 1.0, 1.0), (2, 2, 2)))
    assert [good.min_dihedral, good.max_dihedral] == pytest.approx([45.0, 90.0])
    sunk = block((1.0, 1.0, 0.001), (2, 2, 2))
    assert quality(sunk).slivers == len(sunk.tets)


def test_a_plate_is_half_of_its_thickness_deep() -> None:
    plate = block((0.2, 0.2, 0.02), (20, 20, 2))
    faces = boundary(plate.tets)
    used = np.unique(faces)
    mesh = SurfaceMesh(plate.vertices[used], np.searchsorted(used, faces))
    inner = np.flatnonzero(np.abs(mesh.vertices[:, :2]).max(axis=1) < 0.07)
    assert depth_under(mesh, inner) == pytest.approx(0.01, rel=0.35)
    smooth = np.flatnonzero(is_smooth(mesh))  # up to the edge, where a side is nearer
    through = thickness(mesh, smooth)
    # Exactly, whatever the mesh; from its narrow sides it is as thick as it is wide.
    assert sorted(set(through.round(9).tolist())) == [0.02, 0.2]
