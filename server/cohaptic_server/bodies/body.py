"""The interface of an elastic body. A new kind of body is one file that fulfils this Protocol."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple, Protocol, runtime_checkable

import numpy as np

from cohaptic_server.bodies.superposition import subtract
from cohaptic_server.mesh.surface import SurfaceMesh
from cohaptic_server.numeric import Floats, Ints


@dataclass(frozen=True, eq=False)
class Load:
    """A force on a patch of surface: a contact has a radius and a pressure profile (science 3.5).

    Args:
        vertices: Vertices under the contact, shape (k,).
        weights: Share of the force on each, shape (k,); they sum to 1.
        direction: Unit vector of the force, into the body, shape (3,).
        force: Magnitude [N].
    """

    vertices: Ints
    weights: Floats
    direction: Floats
    force: float


class LoadArrays(NamedTuple):
    """Loads as arrays, for compiled loops over all of them.

    Args:
        starts: Where each load begins in the next two, and the last one's end, shape (c + 1,).
        vertices: Under the loads, one load after the other, shape (k,).
        weights: Share of a load's force on each, shape (k,).
        directions: Of the loads, shape (c, 3).
        forces: Of the loads, shape (c,) [N].
    """

    starts: Ints
    vertices: Ints
    weights: Floats
    directions: Floats
    forces: Floats

    @classmethod
    def of(cls, loads: Sequence[Load]) -> LoadArrays:
        """The arrays of some loads."""
        starts = np.zeros(len(loads) + 1, dtype=np.int64)
        if not loads:
            return cls(starts, starts[:0], np.zeros(0), np.zeros((0, 3)), np.zeros(0))
        np.cumsum([len(load.vertices) for load in loads], out=starts[1:])
        return cls(
            starts,
            np.concatenate([load.vertices for load in loads]),
            np.concatenate([load.weights for load in loads]),
            np.array([load.direction for load in loads]),
            np.array([load.force for load in loads]),
        )


class Response(Protocol):
    """The body under loads. An implementation may compute a value when it is first read."""

    @property
    def compliance(self) -> Floats:
        """Contact compliance C, shape (c, c) [m/N].

        Displacement of contact i along its direction per force at contact j, both weighted by the
        pressure profile.
        """
        ...

    @property
    def energy(self) -> float:
        """Elastic energy stored by the loads [J]."""
        ...

    @property
    def displacement(self) -> Floats:
        """Displacement of every vertex under all loads, shape (n, 3) [m].

        On a large body it takes too long for every tick; use `at`.
        """
        ...

    def at(self, vertices: Ints) -> Floats:
        """Displacement of some vertices under all loads, shape (k, 3) [m]."""
        ...

    def without(self, loads: slice, forces: Floats, vertices: Ints) -> Floats:
        """Displacement of some vertices without some of the loads (science 3.3).

        Args:
            loads: Loads to leave out.
            forces: Forces to subtract from those loads, shape (l,) [N].
            vertices: Shape (k,).

        Returns:
            Shape (k, 3) [m].
        """
        ...


@dataclass(frozen=True, eq=False)
class DenseResponse:
    """A response that stores every vertex, for bodies of a few thousand of them.

    Args:
        displacement: Displacement of every vertex under all loads, shape (n, 3) [m].
        fields: Displacement of every vertex per unit of each load's force, shape (c, n, 3) [m/N].
        compliance: Contact compliance C, shape (c, c) [m/N].
        energy: Elastic energy stored by the loads [J].
    """

    displacement: Floats
    fields: Floats
    compliance: Floats
    energy: float

    def __post_init__(self) -> None:
        # As compiled loops read them; a body may have left them in another order.
        for name in ("displacement", "fields"):
            object.__setattr__(self, name, np.ascontiguousarray(getattr(self, name), np.float64))

    def at(self, vertices: Ints) -> Floats:
        """Displacement of some vertices, shape (k, 3) [m]."""
        return np.asarray(self.displacement[vertices])

    def without(self, loads: slice, forces: Floats, vertices: Ints) -> Floats:
        """Displacement of some vertices without some of the loads, shape (k, 3) [m]."""
        left = np.empty((len(vertices), 3))
        first = loads.indices(len(self.fields))[0]
        subtract(self.displacement, self.fields, first, forces, vertices, left)
        return left


class Body(Protocol):
    """An elastic body that accepts forces and returns positions (an admittance, section 1).

    Every implementation keeps the invariants of science 3.6: C symmetric and positive definite,
    no energy in a rigid motion, the hands' work never less than the energy stored.
    `cohaptic_server.testing.check_body` checks them.
    """

    @property
    def name(self) -> str:
        """Name for people and for the wire."""
        ...

    @property
    def mesh(self) -> SurfaceMesh:
        """The resting surface."""
        ...

    @property
    def contact_radius(self) -> float:
        """Radius of the pressure under a contact [m]."""
        ...

    def respond(self, loads: Sequence[Load], before: Response | None = None) -> Response:
        """The body's response to `loads` in one tick.

        Args:
            loads: The present contacts; a load of zero force still gets its compliance.
            before: Response of the previous tick, from which an iterative or viscous body starts;
                None starts from rest.
        """
        ...


@runtime_checkable
class Prefetching(Protocol):
    """A body that answers better if it knows which vertices will be touched soon."""

    def prefetch(self, vertices: Ints) -> None:
        """Announce the vertices that lie ahead of sliding fingers, shape (k,)."""
        ...
