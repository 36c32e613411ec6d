"""Nearest points on a surface."""

from __future__ import annotations

import numpy as np

from cohaptic_server.mesh.surface import SurfaceMesh
from cohaptic_server.numeric import Floats


def nearest_point(mesh: SurfaceMesh, p: Floats) -> Floats:
    """Nearest point of the resting surface to `p` (3,) [m], shape (3,) [m].

    It is sought on the face of the nearest quadrature point and on that face's neighbours.
    """
    face = int(mesh.quadrature.tree.query(p)[1]) // mesh.split**2
    candidates = nearest_on_triangles(mesh.vertices[mesh.faces[mesh.around[face]]], p)
    gap = candidates - p
    return np.asarray(candidates[np.einsum("fi,fi->f", gap, gap).argmin()])


def nearest_on_triangles(corners: Floats, p: Floats) -> Floats:
    """Nearest point of each triangle to `p`.

    The foot in the triangle's plane where it lies inside, else the nearest point of an edge.

    Args:
        corners: Shape (f, 3, 3) [m].
        p: Shape (3,) [m].

    Returns:
        Shape (f, 3) [m].
    """
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    u, v, w = b - a, c - a, p - a
    uu, uv, vv = _dot(u, u), _dot(u, v), _dot(v, v)
    wu, wv = _dot(w, u), _dot(w, v)
    det = np.maximum(uu * vv - uv * uv, 1e-300)
    s, t = (vv * wu - uv * wv) / det, (uu * wv - uv * wu) / det
    inside = (s >= 0.0) & (t >= 0.0) & (s + t <= 1.0)
    foot = a + s[:, None] * u + t[:, None] * v
    edges = _nearest_on_edges(corners, p)
    gap = edges - p
    best = np.einsum("fei,fei->fe", gap, gap).argmin(axis=1)
    return np.where(inside[:, None], foot, edges[np.arange(len(corners)), best])


def _nearest_on_edges(corners: Floats, p: Floats) -> Floats:
    """Nearest point of each edge of each triangle, shape (f, 3, 3) [m]."""
    u = corners[:, [1, 2, 0]] - corners
    along = np.einsum("fei,fei->fe", p - corners, u) / np.einsum("fei,fei->fe", u, u)
    return np.asarray(corners + np.minimum(np.maximum(along, 0.0), 1.0)[:, :, None] * u)


def _dot(a: Floats, b: Floats) -> Floats:
    return np.asarray(np.einsum("fi,fi->f", a, b))
