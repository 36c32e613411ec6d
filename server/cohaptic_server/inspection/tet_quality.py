"""How good tetrahedra are, and how thick the object is under its surface."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cohaptic_server.mesh.tetrahedra import EDGES, TetMesh, gradients, volumes


@dataclass(frozen=True, slots=True)
class Quality:
    """Of a mesh of tetrahedra.

    Args:
        sharpest: Smallest angle between two faces of one [degrees]; 70.5 in a regular one.
        bluntest: Largest such angle [degrees].
        fullest: Median of the volume over that of the regular one with the same longest edge.
        flattest: Least of that ratio.
        poor: Tetrahedra whose ratio is below a hundredth.
    """

    sharpest: float
    bluntest: float
    fullest: float
    flattest: float
    poor: int


def quality(tets: TetMesh) -> Quality:
    """Angles and ratios of all tetrahedra."""
    g = gradients(tets.vertices, tets.tets)
    n = g / np.linalg.norm(g, axis=2, keepdims=True)
    # Gradients point into the element, away from the face that lies opposite to their corner.
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
