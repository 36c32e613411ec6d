"""How soft a body is where: the compliance of a contact at each vertex of its surface."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from cohaptic_server.bodies.green_columns import GreenColumns
from cohaptic_server.bodies.mesh import Floats, Ints, SurfaceMesh
from cohaptic_server.contact import pressure

# Places pressed on in a survey. Between them the compliance of a contact is smooth; a patch
# brings its own exact C_ii, by which the client scales these.
PLACES = 512
_BATCH = 32
_NEIGHBOURS = 4


def survey(mesh: SurfaceMesh, columns: GreenColumns, radius: float, places: int = PLACES) -> Floats:
    """C_ii of a contact centred at each vertex, along its normal, shape (n,) [m/N].

    Exact at `places` vertices spread over the surface, by distance between them elsewhere.
    """
    chosen = spread(mesh.vertices, places)
    exact = np.empty(len(chosen))
    for start in range(0, len(chosen), _BATCH):
        batch = chosen[start : start + _BATCH]
        under = [pressure(mesh, mesh.vertices[k], radius) for k in batch]
        vertices = np.unique(np.concatenate([v for v, _ in under]))
        forces = np.zeros((len(vertices), 3, len(batch)))
        for r, (k, (v, w)) in enumerate(zip(batch, under, strict=True)):
            forces[np.searchsorted(vertices, v), :, r] = -w[:, None] * mesh.normals[k]
        moved = columns.respond(vertices, forces).reshape(len(batch), -1, 3)[:, vertices]
        exact[start : start + len(batch)] = np.einsum("rki,kir->r", moved, forces)
    # An array of neighbours, so that one of them still has an axis.
    nearest = np.arange(1, min(_NEIGHBOURS, len(chosen)) + 1)
    found = cKDTree(mesh.vertices[chosen]).query(mesh.vertices, k=nearest)
    distance, near = np.asarray(found[0]), np.asarray(found[1])
    weights = 1.0 / np.maximum(distance, 1e-9 * mesh.size) ** 2
    table = (weights * exact[near]).sum(axis=1) / weights.sum(axis=1)
    return np.asarray(np.maximum(0.0, table), dtype=np.float64)


def spread(points: Floats, count: int) -> Ints:
    """Points far from each other, each the farthest from those before it, shape (<= count,)."""
    if len(points) <= count:
        return np.arange(len(points), dtype=np.int64)
    chosen = [int(np.argmin(points[:, 0]))]
    gap = np.full(len(points), np.inf)
    while len(chosen) < count:
        off = points - points[chosen[-1]]
        gap = np.minimum(gap, np.einsum("ni,ni->n", off, off))
        chosen.append(int(gap.argmax()))
    return np.array(chosen, dtype=np.int64)
