"""Checks of a surface: open or non-manifold edges, self-intersections, components, orientation."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
import scipy.sparse.csgraph

from cohaptic_server.mesh.enclosed_volume import volume
from cohaptic_server.numeric import Floats, Ints
from cohaptic_server.objects.surface.self_intersections import count_intersecting


@dataclass(frozen=True, slots=True)
class SurfaceReport:
    """Defects and size of a surface.

    Args:
        open_edges: Number of edges with one triangle only.
        nonmanifold_edges: Number of edges with three or more triangles.
        intersecting: Number of triangles that intersect another one.
        components: Number of connected components.
        volume: Enclosed volume, in cubic units of the file; negative if normals point inwards.
        size: Longest side of the bounding box, in units of the file.
    """

    open_edges: int
    nonmanifold_edges: int
    intersecting: int
    components: int
    volume: float
    size: float

    def problems(self) -> list[str]:
        """A sentence for each defect that prevents filling the surface."""
        problems: list[str] = []
        if self.open_edges:
            problems.append(f"the surface is open: {self.open_edges} edges have one triangle only")
        if self.nonmanifold_edges:
            problems.append(
                f"{self.nonmanifold_edges} edges have three triangles or more; two is right"
            )
        if self.intersecting > 0:
            problems.append(
                f"the surface passes through itself: {self.intersecting} triangles cross"
            )
        return problems

    @property
    def flat(self) -> bool:
        """Whether the surface encloses practically no volume."""
        return abs(self.volume) < 1e-9 * self.size**3


def examine(x: Floats, faces: Ints) -> SurfaceReport:
    """Check a surface whose vertices have been merged.

    Args:
        x: Vertices, shape (n, 3).
        faces: Triangles, shape (m, 3).
    """
    edges = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    counts = edge_counts(faces)
    graph = sp.coo_array(
        (np.ones(len(edges), dtype=np.int8), (edges[:, 0], edges[:, 1])), shape=(len(x), len(x))
    )
    components, _ = scipy.sparse.csgraph.connected_components(sp.csr_array(graph), directed=False)
    centred = x - x.mean(axis=0)
    return SurfaceReport(
        open_edges=int((counts == 1).sum()),
        nonmanifold_edges=int((counts > 2).sum()),
        intersecting=count_intersecting(centred, faces),
        components=int(components),
        volume=volume(centred, faces),
        size=float(np.ptp(x, axis=0).max()),
    )


def edge_counts(faces: Ints) -> Ints:
    """Number of triangles at each edge, shape (edges,); 2 everywhere in a closed surface."""
    edges = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    # Sorting one number for each edge is twenty times as fast as sorting pairs.
    _, counts = np.unique(edges[:, 0] * (faces.max() + 1) + edges[:, 1], return_counts=True)
    return np.asarray(counts, dtype=np.int64)


def facing_outwards(x: Floats, faces: Ints) -> Ints:
    """The triangles, all of them reversed if the surface is inside out; shape (m, 3)."""
    return faces if volume(x - x.mean(axis=0), faces) >= 0.0 else faces[:, [0, 2, 1]]
