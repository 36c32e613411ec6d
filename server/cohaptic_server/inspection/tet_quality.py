"""Quality of a mesh of tetrahedra."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cohaptic_server.mesh.tetrahedra import EDGES, TetMesh, gradients, volumes


@dataclass(frozen=True, slots=True)
class Quality:
    """Dihedral angles and volume ratios of a mesh of tetrahedra.

    A volume ratio is the volume of a tetrahedron over that of the regular one with the same longest
    edge: 1 for a regular tetrahedron, 0 for a flat one.

    Args:
        min_dihedral: Smallest dihedral angle [degrees]; 70.5 in a regular tetrahedron.
        max_dihedral: Largest dihedral angle [degrees].
        median_ratio: Median volume ratio.
        min_ratio: Least volume ratio.
        slivers: Number of tetrahedra whose ratio is below 0.01.
    """

    min_dihedral: float
    max_dihedral: float
    median_ratio: float
    min_ratio: float
    slivers: int


def quality(tets: TetMesh) -> Quality:
    """Measure the quality of a mesh."""
    g = gradients(tets.vertices, tets.tets)
    n = g / np.linalg.norm(g, axis=2, keepdims=True)
    # The gradient of a corner's shape function points inwards, normal to the opposite face.
    cosines = [-np.einsum("mi,mi->m", n[:, a], n[:, b]) for a, b in EDGES]
    angles = np.degrees(np.arccos(np.clip(cosines, -1.0, 1.0)))
    x = tets.vertices
    edges = np.stack([x[tets.tets[:, a]] - x[tets.tets[:, b]] for a, b in EDGES], axis=1)
    longest = np.sqrt(np.einsum("mei,mei->me", edges, edges).max(axis=1))
    ratio = volumes(x, tets.tets) * 6.0 * 2.0**0.5 / longest**3
    return Quality(
        float(angles.min()),
        float(angles.max()),
        float(np.median(ratio)),
        float(ratio.min()),
        int((ratio < 0.01).sum()),
    )
