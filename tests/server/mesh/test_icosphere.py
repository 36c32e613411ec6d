from __future__ import annotations

import numpy as np
import pytest

from cohaptic_server.mesh.enclosed_volume import volume
from cohaptic_server.mesh.icosphere import icosphere
from cohaptic_server.mesh.surface import SurfaceMesh, face_area_vectors


@pytest.mark.parametrize(("subdivisions", "n"), [(1, 42), (2, 162), (3, 642)])
def test_an_icosphere_is_a_closed_sphere_seen_from_outside(subdivisions: int, n: int) -> None:
    x, faces = icosphere(subdivisions, 0.1)
    assert len(x) == n
    # Euler: a closed surface without holes has faces = 2 (vertices - 2).
    assert len(faces) == 2 * (n - 2)
    assert np.linalg.norm(x, axis=1) == pytest.approx(0.1)
    # Area vectors of a closed surface sum to nothing, and point away from the centre.
    areas = face_area_vectors(x, faces)
    assert np.abs(areas.sum(axis=0)).max() < 1e-15
    assert (np.einsum("mi,mi->m", areas, x[faces].mean(axis=1)) > 0.0).all()
    assert SurfaceMesh(x, faces).rings.shape == (n, 6)


def test_a_finer_icosphere_is_rounder_by_a_factor_of_four() -> None:
    """Its edges are half as long, and a chord misses its arc by the square of its length."""
    sphere = 4.0 / 3.0 * np.pi * 0.1**3
    missing = [sphere - volume(*icosphere(level, 0.1)) for level in (1, 2, 3)]
    assert missing[0] / missing[1] == pytest.approx(4.0, rel=0.1)
    assert missing[1] / missing[2] == pytest.approx(4.0, rel=0.1)
