from __future__ import annotations

import numpy as np
import pytest

from cohaptic_server.mesh.tetrahedra import TetMesh
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
