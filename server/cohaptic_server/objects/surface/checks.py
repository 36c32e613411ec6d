"""What is wrong with a surface that somebody brought: open, tangled, in pieces, inside out."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
import scipy.sparse.csgraph

from cohaptic_server.mesh.enclosed_volume import volume
from cohaptic_server.numeric import Floats, Ints
from cohaptic_server.objects.surface.self_intersections import count_crossings


@dataclass(frozen=True, slots=True)
class SurfaceReport:
    """What was found.

    Args:
        open_edges: That belong to one triangle only.
        crowded_edges: That belong to three or more triangles.
        crossings: Triangles that pass through another one; -1 where it was not looked for.
        pieces: That hang together.
        volume: Enclosed, in cubic units of the file; positive when normals point outwards.
        size: Longest side of the box around it.
    """

    open_edges: int
    crowded_edges: int
    crossings: int
    pieces: int
    volume: float
    size: float

    def problems(self) -> list[str]:
        """A sentence for each thing that keeps it from being filled."""
        found: list[str] = []
        if self.open_edges:
            found.append(f"the surface is open: {self.open_edges} edges have one triangle only")
        if self.crowded_edges:
            found.append(f"{self.crowded_edges} edges have three triangles or more; two is right")
        if self.crossings > 0:
            found.append(f"the surface passes through itself: {self.crossings} triangles cross")
        return found

    @property
    def flat(self) -> bool:
        """Whether there is next to nothing in it."""
        return abs(self.volume) < 1e-9 * self.size**3


def examine(x: Floats, faces: Ints) -> SurfaceReport:
    """Look at a surface whose corners have been merged.

    Args:
        x: Shape (n, 3).
        faces: Shape (m, 3).
    """
    edges = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    counts = edge_counts(faces)
    graph = sp.coo_array(
        (np.ones(len(edges), dtype=np.int8), (edges[:, 0], edges[:, 1])), shape=(len(x), len(x))
    )
    pieces, _ = scipy.sparse.csgraph.connected_components(sp.csr_array(graph), directed=False)
    centred = x - x.mean(axis=0)
    return SurfaceReport(
        open_edges=int((counts == 1).sum()),
        crowded_edges=int((counts > 2).sum()),
        crossings=count_crossings(centred, faces),
        pieces=int(pieces),
        volume=volume(centred, faces),
        size=float(np.ptp(x, axis=0).max()),
    )


def edge_counts(faces: Ints) -> Ints:
    """How many triangles each edge has, shape (edges,); two in a closed surface."""
    edges = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    # One number for an edge: sorting rows takes twenty times as long.
    _, counts = np.unique(edges[:, 0] * (faces.max() + 1) + edges[:, 1], return_counts=True)
    return np.asarray(counts, dtype=np.int64)


def facing_outwards(x: Floats, faces: Ints) -> Ints:
    """The same triangles, turned round as a whole where the surface is inside out."""
    return faces if volume(x - x.mean(axis=0), faces) >= 0.0 else faces[:, [0, 2, 1]]
