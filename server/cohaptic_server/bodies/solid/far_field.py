"""The far field of a solid: its compliance between a few hundred samples of its surface.

    C(x, y) ~ psi(x)' G psi(y),    G_pq: displacement of sample p per unit force at sample q

C(x, y) is the displacement of vertex x per unit force at vertex y. G is exact between contacts
centred at samples, which are spread over the surface. The weights psi distribute a force to the
samples round it, and interpolate a displacement from them. They preserve moments up to the second
order (moving least squares), so that the field a few sample spacings away is right to third order.
But psi smooths the dent under the force itself, so that psi' G psi is too small there. The
self-compliance of a contact is therefore the mean of the exact self-compliances of contacts centred
at the vertices under it.

The far field replaces columns that have not been solved yet, and serves vertices that lie too far
from a contact for its columns to matter.

The far field is built from presses all over the surface. A press needs only forward substitution
(`cholesky/factorise.py`). The presses on the samples give the compliance between all samples, and a
press on each vertex gives that vertex's self-compliance. Moving least squares give the weights for
the interpolation from the samples.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
import scipy.sparse as sp

from cohaptic.errors import BodyError
from cohaptic_server.bodies.solid import far_field_kernels as kernels
from cohaptic_server.cholesky.factor import Factor
from cohaptic_server.cholesky.factorise import mutual_compliance, self_compliance
from cohaptic_server.mesh.surface import SurfaceMesh, pressure, spread_over
from cohaptic_server.numeric import Floats, Ints, Narrow


@dataclass(frozen=True, eq=False)
class FarField:
    """The far field of a solid: the compliance between samples of the surface.

    Args:
        samples: Vertices of the surface, shape (m,).
        near: Samples round each vertex, as indices into `samples`, shape (n, k).
        carries: Weights that distribute a vertex's force to the samples and interpolate the
            vertex's displacement from them; zero at fixed vertices, shape (n, k).
        compliance: Compliance G: displacement of a sample in x, y, z per unit force at another,
            both averaged over a contact's pressure, shape (3 m, 3 m) [m/N].
        own: Self-compliance of a contact centred at each vertex, as the rows of a 3x3 block; zero
            if no free vertex is under the contact, shape (n, 9) [m/N].
        spacing: Mean distance between neighbouring samples [m].
    """

    samples: Ints
    near: Ints
    carries: Floats
    compliance: Narrow
    own: Floats
    spacing: float

    def spread(self, vertices: Ints, weights: Floats) -> Floats:
        """Return the share of each sample in a force on some vertices, shape (m,).

        Args:
            vertices: Vertices under the force, shape (k,).
            weights: Share of the force on each vertex, shape (k,).

        Raises:
            IndexError: A vertex does not exist.
        """
        out = np.empty(len(self.samples))
        if not kernels.spread(self.near, self.carries, vertices, weights, out):
            raise IndexError("a vertex is not one of the surface's")
        return out

    def respond(self, spread: Floats, out: Floats) -> None:
        """Compute the displacement of the samples per unit force that is distributed to them.

        Args:
            spread: Share of the force on each sample, shape (m,).
            out: Receives the displacement per unit force along x, y, z, shape (3, m, 3) [m/N].
        """
        m = len(self.samples)
        sums = np.empty(9 * m, dtype=np.float32)
        kernels.respond(self.compliance.reshape(m, 9 * m), spread, sums, out.reshape(9 * m))

    def interpolated(self, values: Floats, vertices: Ints) -> Floats:
        """Interpolate a displacement from the samples at some vertices.

        Args:
            values: Displacement of the samples, shape (m, 3) [m].
            vertices: Vertices at which it is interpolated, shape (k,).

        Returns:
            Displacement of these vertices, shape (k, 3) [m].

        Raises:
            IndexError: A vertex does not exist.
        """
        out = np.empty((len(vertices), 3))
        if not kernels.interpolate(self.near, self.carries, vertices, values, out):
            raise IndexError("a vertex is not one of the surface's")
        return out

    def without(self, values: Floats, field: Floats, force: Floats) -> Floats:
        """Return the displacement of the samples without one of the forces, shape (m, 3) [m].

        Args:
            values: Displacement by all forces, shape (m, 3) [m].
            field: Result of `respond` for the contact of the force, shape (3, m, 3) [m/N].
            force: Force to leave out, shape (3,) [N].
        """
        out = np.empty_like(values)
        kernels.subtract(values, field, force, out)
        return out

    def between(self, spreads: Floats, fields: Floats) -> Floats:
        """Return the displacement of each contact by a unit force on each, from samples alone.

        Args:
            spreads: Result of `spread` for each contact, shape (c, m).
            fields: Result of `respond` for each contact, shape (c, 3, m, 3) [m/N].

        Returns:
            Displacement of contact i by 1 N in x, y, z on contact j, shape (c, c, 3, 3) [m/N].
        """
        out = np.empty((len(spreads), len(spreads), 3, 3))
        kernels.between(spreads, fields, out)
        return out

    def self_compliance(self, vertices: Ints, weights: Floats, direction: Floats) -> float:
        """Return the self-compliance of a contact, a mean of `own` over its vertices [m/N].

        Args:
            vertices: Vertices under the contact, shape (k,).
            weights: Share of the force on each vertex, shape (k,).
            direction: Unit vector of the force, shape (3,).

        Raises:
            IndexError: A vertex does not exist.
        """
        found = kernels.own_compliance(self.own, vertices, weights, direction)
        if found < 0.0:
            raise IndexError("a vertex is not one of the surface's")
        return found

    def vertex_compliance(self, normals: Floats) -> Floats:
        """Return the compliance of a contact at each vertex along its normal, shape (n,) [m/N].

        Args:
            normals: Unit normals of the vertices, shape (n, 3).
        """
        table: Floats = np.einsum("ni,nij,nj->n", normals, self.own.reshape(-1, 3, 3), normals)
        return table

    def times(self, compliance: float) -> FarField:
        """Return the far field of a body that is `compliance` times as compliant."""
        return replace(
            self, compliance=np.float32(compliance) * self.compliance, own=compliance * self.own
        )

    def to_arrays(self) -> dict[str, npt.NDArray[np.generic]]:
        """Return the arrays for a file, under the names that stored objects have always used."""
        return {
            "places": self.samples,
            "near": self.near,
            "carries": self.carries,
            "compliance": self.compliance,
            "own": self.own,
            "spacing": np.array(self.spacing),
        }

    @classmethod
    def from_arrays(cls, arrays: dict[str, npt.NDArray[np.generic]]) -> FarField:
        """Return the far field with the arrays of `to_arrays`.

        Raises:
            BodyError: An array is missing, or the arrays do not fit together.
        """
        try:
            found = cls(
                np.ascontiguousarray(arrays["places"], dtype=np.int64),
                np.ascontiguousarray(arrays["near"], dtype=np.int64),
                np.ascontiguousarray(arrays["carries"], dtype=np.float64),
                np.ascontiguousarray(arrays["compliance"], dtype=np.float32),
                np.ascontiguousarray(arrays["own"], dtype=np.float64),
                float(np.asarray(arrays["spacing"], dtype=np.float64)),
            )
        except KeyError as error:
            raise BodyError(f"a stored object lacks {error}") from error
        m, near = len(found.samples), found.near
        # The kernels do not check that an index lies within its array.
        if (
            near.ndim != 2
            or found.carries.shape != near.shape
            or found.own.shape != (len(near), 9)
            or found.compliance.shape != (3 * m, 3 * m)
            or near.min(initial=0) < 0
            or near.max(initial=-1) >= m
        ):
            raise BodyError("the arrays of a stored object do not fit together")
        return found


SAMPLES = 600
_NEIGHBOURS = 16  # samples from which a vertex is interpolated
_MIN_COSINE = 0.3  # between normals; a sample below this is on another side of the body
# Presses in one elimination. Twice as many would be only 10 % faster. The largest factor that
# `objects/prepare.py` makes has fronts of 20,000 rows: the forces of 256 presses take 120 MB.
_BATCH = 256
_FRACTION_OF_SAMPLES = 0.1  # rough share of the presses on samples in the time of all presses
_CORE = 0.1  # squared distance, relative to the farthest sample's, at which the weight levels off
_TIKHONOV_LINEAR = 1e-6  # relative Tikhonov term on the linear coefficients
_TIKHONOV_QUADRATIC = 1e-5  # relative Tikhonov term on the quadratic coefficients
_OTHER_SIDE = 1e-4  # weight of a sample on another side, which matters if all samples are there


def build_far_field(
    mesh: SurfaceMesh,
    radius: float,
    factor: Factor,
    nodes: Ints,
    progress: Callable[[float], None] = lambda fraction: None,
    count: int = SAMPLES,
) -> FarField:
    """Build the far field from the responses to a press on every sample and on every vertex.

    Args:
        mesh: Resting surface.
        radius: Contact radius [m].
        factor: Factor of the stiffness over the free nodes, in double precision.
        nodes: Index of each vertex among the free nodes, -1 where it is fixed, shape (n,).
        progress: Receives the completed share, up to 1.
        count: Largest number of samples.
    """
    samples = spread_over(mesh.vertices, count)
    presses = _presses(mesh, radius, nodes, factor.size // 3)
    G = mutual_compliance(
        factor,
        sp.csr_array(presses[:, samples]),
        lambda fraction: progress(_FRACTION_OF_SAMPLES * fraction),
    )
    own = _own_blocks(
        factor,
        presses,
        lambda fraction: progress(_FRACTION_OF_SAMPLES + (1.0 - _FRACTION_OF_SAMPLES) * fraction),
    )
    near, carries = _interpolation(mesh, samples, radius)
    carries[nodes < 0] = 0.0
    spacing = mesh.spacing(len(samples))
    return FarField(samples, near, carries, G.astype(np.float32), own, spacing)


def _presses(mesh: SurfaceMesh, radius: float, nodes: Ints, free: int) -> sp.csc_array:
    """Return the share of each free node in a press on each vertex, shape (free, n).

    The force on fixed vertices causes no displacement and is left out.
    """
    found = [
        pressure(mesh, at, radius, normal)
        for at, normal in zip(mesh.vertices, mesh.normals, strict=True)
    ]
    column = np.repeat(np.arange(len(found)), [len(under) for under, _ in found])
    row = nodes[np.concatenate([under for under, _ in found])]
    weights = np.concatenate([fractions for _, fractions in found])
    loaded = row >= 0
    table = (weights[loaded], (row[loaded], column[loaded]))
    return sp.csc_array(sp.coo_array(table, shape=(free, len(found))))


def _own_blocks(factor: Factor, presses: sp.csc_array, progress: Callable[[float], None]) -> Floats:
    """Return the self-compliance of the press on each vertex, shape (n, 9) [m/N]."""
    count = presses.shape[1]
    # Presses with the same path to the root share a batch. Presses on fixed vertices have no path.
    lowest = np.full(count, -1)
    loaded = np.flatnonzero(np.diff(presses.indptr))
    fronts = factor.front_of[presses.indices]
    lowest[loaded] = np.minimum.reduceat(fronts, presses.indptr[loaded])
    order = np.argsort(lowest, kind="stable")
    own = np.zeros((count, 9))
    first = 0

    def report(fraction: float) -> None:
        progress(min(1.0, (first + _BATCH * fraction) / count))

    for first in range(0, count, _BATCH):
        batch = order[first : first + _BATCH]
        blocks = self_compliance(factor, sp.csr_array(presses[:, batch]), report)
        own[batch] = blocks.reshape(-1, 9)
    return own


def _interpolation(mesh: SurfaceMesh, samples: Ints, radius: float) -> tuple[Ints, Floats]:
    """Return the samples round each vertex and their weights `carries`, shape (n, k) each.

    The weights come from moving least squares. They reproduce quadratic functions in the tangent
    plane when the force on each sample is spread over a pressure 1 - (r / radius)^2 at distance r,
    whose second moment is radius^2 / 6. So a force keeps its moments although the samples' pressure
    blurs it again. If every vertex is a sample, each vertex is interpolated from itself alone.
    """
    from scipy.spatial import cKDTree  # not with the module, as in `mesh/surface.py`

    x = mesh.vertices
    k = min(_NEIGHBOURS, len(samples))
    # k is passed as an array, so that a single neighbour still has an axis.
    near = np.asarray(cKDTree(x[samples]).query(x, k=np.arange(1, k + 1))[1], dtype=np.int64)
    off = x[samples][near] - x[:, None, :]  # (n, k, 3)
    distance = np.sqrt(np.einsum("vki,vki->vk", off, off))
    # The weight is almost zero at the farthest neighbour: a change of neighbours causes no jump.
    reach = np.maximum(distance[:, -1:], 1e-12) * (1.0 + 1e-6)
    weights = _kernel(distance / reach) * _same_side(mesh.normals, samples, near)
    basis = _tangent_basis(mesh.normals, off, reach)
    weighted = basis * weights[:, :, None]
    moments = np.einsum("vka,vkb->vab", weighted, basis)
    # Collinear samples leave one direction undetermined, and few samples the curvature; the
    # Tikhonov term then makes the function flat there.
    tikhonov = np.diag([0.0, *[_TIKHONOV_LINEAR] * 2, *[_TIKHONOV_QUADRATIC] * 3])
    moments += np.trace(moments, axis1=1, axis2=2)[:, None, None] * tikhonov
    target = np.zeros((len(x), 6, 1))
    target[:, 0] = 1.0
    target[:, [3, 5], 0] = -(radius**2) / 6.0 / reach**2
    coefficients = np.asarray(np.linalg.solve(moments, target), dtype=np.float64)
    fractions: Floats = (weighted @ coefficients)[:, :, 0]
    fractions /= fractions.sum(axis=1, keepdims=True)
    if len(samples) == len(x):
        fractions[:] = samples[near] == np.arange(len(x))[:, None]
    # Contiguous, because every tick takes rows from this array.
    return near, np.ascontiguousarray(fractions)


def _kernel(part: Floats) -> Floats:
    """Return the weight of each neighbour: Wendland's C2 function, raised at short distances.

    Args:
        part: Distance of each neighbour over that of the farthest one, shape (n, k).
    """
    return np.asarray(((1.0 - part) ** 4 * (4.0 * part + 1.0) + 1e-9) / (part * part + _CORE))


def _same_side(normals: Floats, samples: Ints, near: Ints) -> Floats:
    """Return a weight by the angle between a neighbour's normal and the vertex's, shape (n, k)."""
    cosine = np.einsum("vki,vi->vk", normals[samples][near], normals)
    return np.asarray(np.clip((cosine - _MIN_COSINE) / (1.0 - _MIN_COSINE), _OTHER_SIDE, 1.0))


def _tangent_basis(normals: Floats, off: Floats, reach: Floats) -> Floats:
    """Return monomials up to degree 2 in the neighbours' tangent coordinates, (n, k, 6)."""
    helper = np.eye(3)[np.abs(normals).argmin(axis=1)]
    first = np.cross(normals, helper)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    second = np.cross(normals, first)
    u, v = (np.einsum("vki,vi->vk", off, axis) / reach for axis in (first, second))
    return np.stack([np.ones_like(u), u, v, u**2, u * v, v**2], axis=2)
