"""The far field of a solid: its compliance between a few hundred samples of its surface.

    C(x, y) ~ psi(x)' G psi(y),    G_pq: displacement of sample p per unit force at sample q

G is exact between contacts centred at samples, which are spread over the surface. psi distributes a
force to the samples round it and interpolates a displacement from them; it preserves moments up to
the second order (moving least squares), so that the field a few sample spacings away is right to
third order. But psi smooths the dent under the force itself, so that psi' G psi is too small there.
The self-compliance of a contact is therefore the mean of the exact self-compliances of contacts
centred at the vertices under it.

The far field replaces columns that have not been solved yet, and serves vertices that lie too far
from a contact for its columns to matter.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from cohaptic.errors import BodyError
from cohaptic_server.bodies.solid import far_field_kernels as kernels
from cohaptic_server.numeric import Floats, Ints, Narrow


@dataclass(frozen=True, eq=False)
class FarField:
    """The far field of a solid: the compliance between samples of the surface.

    Args:
        samples: Vertices of the surface, shape (m,).
        near: Samples round each vertex, as indices into `samples`, shape (n, k).
        carries: Weights that distribute a vertex's force to the samples and interpolate the
            vertex's displacement from them; zero at fixed vertices, shape (n, k).
        compliance: G, displacement of a sample in x, y, z per unit force at another, both averaged
            over a contact's pressure, shape (3 m, 3 m) [m/N].
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
        """Share of each sample in a force on `vertices` (k,) with `weights` (k,), shape (m,).

        Raises:
            IndexError: A vertex does not exist.
        """
        out = np.empty(len(self.samples))
        if not kernels.spread(self.near, self.carries, vertices, weights, out):
            raise IndexError("a vertex is not one of the surface's")
        return out

    def respond(self, spread: Floats, out: Floats) -> None:
        """Compute the displacement of the samples under a force on them.

        Args:
            spread: Share of the force on each sample, shape (m,).
            out: Receives displacement per unit force along x, y, z, shape (3, m, 3) [m/N].
        """
        m = len(self.samples)
        sums = np.empty(9 * m, dtype=np.float32)
        kernels.respond(self.compliance.reshape(m, 9 * m), spread, sums, out.reshape(9 * m))

    def at(self, values: Floats, vertices: Ints) -> Floats:
        """Interpolate a displacement of the samples, shape (m, 3), at vertices (k,).

        Returns:
            Shape (k, 3).

        Raises:
            IndexError: A vertex does not exist.
        """
        out = np.empty((len(vertices), 3))
        if not kernels.interpolate(self.near, self.carries, vertices, values, out):
            raise IndexError("a vertex is not one of the surface's")
        return out

    def without(self, values: Floats, field: Floats, force: Floats) -> Floats:
        """Displacement of the samples without one of the forces, shape (m, 3) [m].

        Args:
            values: Displacement with all forces, shape (m, 3) [m].
            field: Result of `respond` for the force's contact, shape (3, m, 3) [m/N].
            force: Force to leave out, shape (3,) [N].
        """
        out = np.empty_like(values)
        kernels.subtract(values, field, force, out)
        return out

    def between(self, spreads: Floats, fields: Floats) -> Floats:
        """Displacement of each contact by a force on each contact, from the samples alone.

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
        """Self-compliance of a contact, a mean of `own` over the vertices under the contact [m/N].

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
        """C_ii of a contact centred at each vertex, along the vertex normal, shape (n,) [m/N].

        Args:
            normals: Unit normals of the vertices, shape (n, 3).
        """
        table: Floats = np.einsum("ni,nij,nj->n", normals, self.own.reshape(-1, 3, 3), normals)
        return table

    def to_arrays(self) -> dict[str, npt.NDArray[np.generic]]:
        """Returns the arrays for a file, under the names that stored objects have always used."""
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
        """Returns the far field from the arrays of `to_arrays`.

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
