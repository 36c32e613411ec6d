"""The far field of a solid: its compliance between a few hundred samples of its surface.

    C(x, y) ~ psi(x)' G psi(y),    G_pq: displacement of sample p per unit force at sample q

G is exact, between contacts centred at samples that are spread over the surface. psi distributes a
force to the samples round it and interpolates a displacement from them; it preserves moments up to
the second order (moving least squares), so that the field a few sample spacings away is right to
third order. It smooths the dent under the force itself: the compliance of a contact at its own
place is therefore interpolated from the samples' own, which are exact, and not taken from
psi' G psi, which is smaller.

The far field answers for columns that have not been solved yet, and for vertices that lie too far
from a contact for its columns to matter.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from cohaptic.errors import BodyError
from cohaptic_server.numeric import Floats, Ints, Narrow, cross


@dataclass(frozen=True, eq=False)
class SampledContact:
    """A contact whose force is distributed to the samples.

    Args:
        vertices: Vertices under the contact, shape (k,).
        weights: Share of the force on each, shape (k,).
        spread: Share of the force on each sample, shape (m,).
        per_force: Displacement of the samples per unit force along x, y, z, shape (3, m, 3) [m/N].
    """

    vertices: Ints
    weights: Floats
    spread: Floats
    per_force: Floats


@dataclass(frozen=True, eq=False)
class FarField:
    """The compliance of a solid between samples of its surface.

    Args:
        samples: Vertices of the surface, shape (m,).
        normals: Outward unit normals there, shape (m, 3).
        near: Samples round each vertex, as indices into `samples`, shape (n, k).
        means: Weights that interpolate a smooth function of the samples at a vertex, shape (n, k).
        carries: Weights that distribute a vertex's force to the samples and interpolate their
            displacement; zero at fixed vertices, shape (n, k).
        compliance: G, displacement of a sample in x, y, z per unit force at another, both averaged
            over a contact's pressure, shape (3 m, 3 m) [m/N].
        spacing: Mean distance between neighbouring samples [m].
    """

    samples: Ints
    normals: Floats
    near: Ints
    means: Floats
    carries: Floats
    compliance: Narrow
    spacing: float

    def spread(self, vertices: Ints, weights: Floats) -> Floats:
        """Share of each sample in a force on `vertices` (k,) with `weights` (k,), shape (m,)."""
        shares = weights[:, None] * self.carries[vertices]
        total = np.bincount(self.near[vertices].ravel(), shares.ravel(), len(self.samples))
        return np.asarray(total, dtype=np.float64)

    def sampled(self, vertices: Ints, weights: Floats) -> SampledContact:
        """A contact on `vertices` (k,) with `weights` (k,), for any direction of its force."""
        spread = self.spread(vertices, weights)
        used = np.flatnonzero(spread)
        rows = self.compliance.reshape(len(self.samples), -1).take(used, 0)  # (u, 3 * 3 m)
        per_force = np.dot(spread[used].astype(np.float32), rows)
        blocks = per_force.reshape(3, -1, 3).astype(np.float64)
        return SampledContact(vertices, weights, spread, blocks)

    def response(self, spread: Floats, direction: Floats) -> Floats:
        """Displacement of the samples per unit force, shape (m, 3) [m/N].

        Args:
            spread: Share of the force on each sample, shape (m,).
            direction: Unit vector of the force, shape (3,).
        """
        used = np.flatnonzero(spread)
        rows = (3 * used[:, None] + np.arange(3)).ravel()
        force = (spread[used, None] * direction).ravel().astype(np.float32)
        response = np.dot(force, self.compliance[rows])
        return np.asarray(response, dtype=np.float64).reshape(-1, 3)

    def at(self, values: Floats, vertices: Ints) -> Floats:
        """Interpolate a quantity of the samples, such as a displacement, at vertices.

        Args:
            values: The quantity at the samples, shape (m, c).
            vertices: Shape (k,).

        Returns:
            Shape (k, c).
        """
        shares, near = self.carries.take(vertices, 0), self.near.take(vertices, 0)
        neighbours = values.take(near.ravel(), 0).reshape(*near.shape, values.shape[1])
        return np.asarray((shares[:, None, :] @ neighbours)[:, 0])

    def self_compliance(
        self, vertices: Ints, weights: Floats, direction: Floats, normal: Floats
    ) -> float:
        """Compliance of a contact at itself, interpolated from the samples' own [m/N].

        A surface is stiffer along its normal than across it: the direction of the force is turned
        along with the normal from the contact to each sample.

        Args:
            vertices: Vertices under the contact, shape (k,).
            weights: Share of the force on each, shape (k,).
            direction: Unit vector of the force, shape (3,).
            normal: Outward unit normal of the surface at the contact, shape (3,).
        """
        shares = (weights[:, None] * self.means[vertices]).ravel()
        used, index = np.unique(self.near[vertices].ravel(), return_inverse=True)
        turned = _turn(direction, normal, self.normals[used])  # (u, 3)
        along = np.einsum("ui,uij,uj->u", turned, self._diagonal(used), turned)
        return max(0.0, float(shares @ along[index]))

    def vertex_compliance(self) -> Floats:
        """C_ii of a contact centred at each vertex, along its normal, shape (n,) [m/N]."""
        along = np.einsum(
            "pi,pij,pj->p", self.normals, self._diagonal(np.arange(len(self.samples))), self.normals
        )
        table: Floats = (self.means * along[self.near]).sum(axis=1)
        return np.maximum(0.0, table)

    def _diagonal(self, samples: Ints) -> Floats:
        """Compliance of each of some samples at itself, shape (p, 3, 3) [m/N]."""
        rows = 3 * samples[:, None] + np.arange(3)
        blocks = self.compliance[rows[:, :, None], rows[:, None, :]]
        return np.asarray(blocks, dtype=np.float64)

    def to_arrays(self) -> dict[str, npt.NDArray[np.generic]]:
        """The arrays of a file, by the names that stored objects have used from the start."""
        return {
            "places": self.samples,
            "normals": self.normals,
            "near": self.near,
            "means": self.means,
            "carries": self.carries,
            "compliance": self.compliance,
            "spacing": np.array(self.spacing),
        }

    @classmethod
    def from_arrays(cls, arrays: dict[str, npt.NDArray[np.generic]]) -> FarField:
        """The far field of `to_arrays`.

        Raises:
            BodyError: An array is missing.
        """
        try:
            return cls(
                np.asarray(arrays["places"], dtype=np.int64),
                np.asarray(arrays["normals"], dtype=np.float64),
                np.asarray(arrays["near"], dtype=np.int64),
                np.asarray(arrays["means"], dtype=np.float64),
                np.asarray(arrays["carries"], dtype=np.float64),
                np.asarray(arrays["compliance"], dtype=np.float32),
                float(np.asarray(arrays["spacing"], dtype=np.float64)),
            )
        except KeyError as error:
            raise BodyError(f"a stored object lacks {error}") from error


def _turn(direction: Floats, normal: Floats, others: Floats) -> Floats:
    """`direction` under the smallest rotations that take `normal` to each of `others` (u, 3)."""
    cosine = others @ normal
    axis = cross(np.broadcast_to(normal, others.shape), others)
    # Rodrigues' formula. Between opposite normals the rotation is not defined; samples of the
    # opposite side have almost no weight.
    along = axis @ direction
    scale = along / np.maximum(1.0 + cosine, 1e-3)
    across = cross(axis, np.broadcast_to(direction, axis.shape))
    return np.asarray(cosine[:, None] * direction + across + scale[:, None] * axis)
