"""Builds the far field of a solid: a press on every sample, and the interpolation weights."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.spatial import cKDTree

from cohaptic_server.bodies.solid.far_field import FarField
from cohaptic_server.mesh.pressure import pressure
from cohaptic_server.mesh.sampling import spread_over
from cohaptic_server.mesh.surface import SurfaceMesh
from cohaptic_server.numeric import Floats, Ints, Mask

SAMPLES = 600
_NEIGHBOURS = 16  # samples that a vertex is interpolated from
_MIN_COSINE = 0.3  # between normals; a sample below it lies on another side of the body
_BATCH = 16  # samples in one solve
_CORE = 0.1  # share of the reach, squared, below which the weight levels off
_TIKHONOV_LINEAR = 1e-6  # relative Tikhonov term on the linear coefficients
_TIKHONOV_QUADRATIC = 1e-5  # relative Tikhonov term on the quadratic coefficients
_OTHER_SIDE = 1e-4  # weight of a sample of another side: it counts where there is no other

Solve = Callable[[Ints, Floats], Floats]  # as `GreenColumns.respond`


def build_far_field(
    mesh: SurfaceMesh,
    radius: float,
    solve: Solve,
    fixed: Mask | None = None,
    progress: Callable[[float], None] = lambda share: None,
    count: int = SAMPLES,
) -> FarField:
    """Solve for a press on every sample.

    Args:
        mesh: Resting surface.
        radius: Contact radius [m].
        solve: Displacement of all vertices under forces on some, as `GreenColumns.respond`.
        fixed: Vertices that do not move, shape (n,); none if not given.
        progress: Receives the completed share, up to 1.
        count: Largest number of samples.
    """
    samples = spread_over(mesh.vertices, count)
    contacts = [pressure(mesh, mesh.vertices[k], radius, mesh.normals[k]) for k in samples]
    G = np.empty((3 * len(samples), 3 * len(samples)), dtype=np.float32)
    for start in range(0, len(samples), _BATCH):
        batch = contacts[start : start + _BATCH]
        vertices = np.unique(np.concatenate([v for v, _ in batch]))
        forces = np.zeros((len(vertices), 3, 3 * len(batch)))
        for r, (v, w) in enumerate(batch):
            at = np.searchsorted(vertices, v)
            for axis in range(3):
                forces[at, axis, 3 * r + axis] = w
        moved = solve(vertices, forces).reshape(3 * len(batch), -1, 3)
        for p, (v, w) in enumerate(contacts):
            G[3 * start : 3 * (start + len(batch)), 3 * p : 3 * p + 3] = np.tensordot(
                moved[:, v], w, axes=(1, 0)
            )
        progress(min(1.0, (start + len(batch)) / len(samples)))
    near, means, carries = _interpolation(mesh, samples, radius)
    if fixed is not None:
        carries[fixed] = 0.0
    return FarField(
        samples,
        mesh.normals[samples],
        near,
        means,
        carries,
        0.5 * (G + G.T),
        mesh.spacing(len(samples)),
    )


def _interpolation(mesh: SurfaceMesh, samples: Ints, radius: float) -> tuple[Ints, Floats, Floats]:
    """Samples round each vertex and both kinds of weights, (n, k) each: moving least squares.

    The weights `means` reproduce quadratic functions in the tangent plane. Those of `carries` do so
    once each sample is spread out by its pressure 1 - (r / radius)^2, of second moment
    radius^2 / 6: a force that the samples' pressure blurs again keeps its moments. Where every
    vertex is a sample, each is interpolated from itself alone.
    """
    x = mesh.vertices
    k = min(_NEIGHBOURS, len(samples))
    # An array of neighbours, so that a single one still has an axis.
    near = np.asarray(cKDTree(x[samples]).query(x, k=np.arange(1, k + 1))[1], dtype=np.int64)
    off = x[samples][near] - x[:, None, :]  # (n, k, 3)
    distance = np.sqrt(np.einsum("vki,vki->vk", off, off))
    # The weight is all but zero at the farthest neighbour: a change of neighbours makes no step.
    reach = np.maximum(distance[:, -1:], 1e-12) * (1.0 + 1e-6)
    weights = _kernel(distance / reach) * _same_side(mesh.normals, samples, near)
    basis = _tangent_basis(mesh.normals, off, reach)
    weighted = basis * weights[:, :, None]
    moments = np.einsum("vka,vkb->vab", weighted, basis)
    # Collinear samples leave one direction undetermined, few samples the curvature: the Tikhonov
    # term then takes the function as flat.
    tikhonov = np.diag([0.0, *[_TIKHONOV_LINEAR] * 2, *[_TIKHONOV_QUADRATIC] * 3])
    moments += np.trace(moments, axis1=1, axis2=2)[:, None, None] * tikhonov
    target = np.zeros((len(x), 6, 2))
    target[:, 0] = 1.0
    target[:, [3, 5], 1] = -(radius**2) / 6.0 / reach**2
    coefficients = np.asarray(np.linalg.solve(moments, target), dtype=np.float64)
    shares: Floats = weighted @ coefficients  # (n, k, 2)
    shares /= shares.sum(axis=1, keepdims=True)
    if len(samples) == len(x):
        shares[:] = (samples[near] == np.arange(len(x))[:, None])[:, :, None]
    # Contiguous, as rows are taken from both in every tick.
    return near, np.ascontiguousarray(shares[:, :, 0]), np.ascontiguousarray(shares[:, :, 1])


def _kernel(part: Floats) -> Floats:
    """Wendland's C2 function over a singular core: a vertex that is a sample takes that sample.

    Args:
        part: Distance over that of the farthest neighbour, shape (n, k).
    """
    return np.asarray(((1.0 - part) ** 4 * (4.0 * part + 1.0) + 1e-9) / (part * part + _CORE))


def _same_side(normals: Floats, samples: Ints, near: Ints) -> Floats:
    """Weight of each neighbour by the angle between its normal and the vertex's, shape (n, k)."""
    cosine = np.einsum("vki,vi->vk", normals[samples][near], normals)
    return np.asarray(np.clip((cosine - _MIN_COSINE) / (1.0 - _MIN_COSINE), _OTHER_SIDE, 1.0))


def _tangent_basis(normals: Floats, off: Floats, reach: Floats) -> Floats:
    """Monomials up to degree 2 of the neighbours' tangent coordinates, shape (n, k, 6)."""
    helper = np.eye(3)[np.abs(normals).argmin(axis=1)]
    first = np.cross(normals, helper)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    second = np.cross(normals, first)
    u, v = (np.einsum("vki,vi->vk", off, axis) / reach for axis in (first, second))
    return np.stack([np.ones_like(u), u, v, u**2, u * v, v**2], axis=2)
