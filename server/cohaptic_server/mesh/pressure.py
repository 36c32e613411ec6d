"""The pressure of a fingertip on a surface, as shares of its force on vertices."""

from __future__ import annotations

import math

import numpy as np

from cohaptic_server.mesh.surface import SurfaceMesh
from cohaptic_server.numeric import Floats, Ints


def smooth_point(mesh: SurfaceMesh, foot: Floats, vertices: Ints, weights: Floats) -> Floats:
    """The point of the smooth resting surface over a point of a facet, shape (3,) [m].

    Each vertex under the pressure estimates the height of the surface from its position and normal;
    the mean of its normal and the common one makes the estimate exact to second order, and so on
    every quadric.

    Args:
        mesh: Resting surface.
        foot: A point on a facet, shape (3,) [m].
        vertices: Vertices under the pressure, shape (k,).
        weights: Share of the force on each, shape (k,).
    """
    normals = mesh.normals[vertices]
    n = weights @ normals
    n /= math.sqrt(float(n @ n))
    gap = mesh.vertices[vertices] - foot
    height = float(weights @ np.einsum("ki,ki->k", gap, 0.5 * (normals + n)))
    return np.asarray(foot + height * n)


def pressure(mesh: SurfaceMesh, point: Floats, radius: float) -> tuple[Ints, Floats]:
    """Vertices under a pressure round `point`, and the share of the force on each.

    The pressure falls as 1 - (r / radius)^2 over the surface; each quadrature point distributes its
    part to the corners of its face. A radius below the mesh's resolution loads the nearest
    quadrature point alone.

    Args:
        mesh: Resting surface.
        point: Centre of the pressure, shape (3,) [m].
        radius: Contact radius [m].

    Returns:
        Vertices (k,) and weights (k,) that sum to 1.
    """
    q = mesh.quadrature
    under = q.tree.query_ball_point(point, radius)
    if not under:
        under = [int(q.tree.query(point)[1])]
    gap = q.points[under] - point
    profile = np.maximum(1.0 - np.einsum("qi,qi->q", gap, gap) / radius**2, 1e-12)
    shares = (profile * q.areas[under])[:, None] * q.shares[under]
    table = np.bincount(q.vertices[under].ravel(), weights=shares.ravel())
    vertices = np.flatnonzero(table)
    weights = table[vertices]
    return vertices, weights / weights.sum()
