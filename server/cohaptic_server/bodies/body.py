"""The interface of an elastic body: a new kind of body is one file that implements `Body`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import NamedTuple, Protocol, overload, runtime_checkable

import numpy as np

from cohaptic.control.stability.swing import Swing
from cohaptic_server.bodies.superposition import subtract_own
from cohaptic_server.mesh.surface import SurfaceMesh
from cohaptic_server.numeric import Floats, Ints


@dataclass(frozen=True, eq=False)
class Load:
    """A force on the surface, distributed over the vertices under a contact (science 3.5).

    Args:
        vertices: Vertices under the contact, shape (k,).
        weights: Share of the force on each vertex, shape (k,); the shares sum to 1.
        direction: Unit vector of the force, shape (3,); a press points into the body.
        force: Force along `direction` [N].
    """

    vertices: Ints
    weights: Floats
    direction: Floats
    force: float


class LoadArrays(NamedTuple):
    """Several loads as arrays, for compiled loops over all of them.

    Args:
        starts, ends: First index of each load in `vertices` and `weights`, and the index after its
            last one, shape (c,) each; the loads of a contact with friction share one range.
        vertices: Vertices under the loads, shape (k,) or longer.
        weights: Share of a load's force on each vertex, shape (k,) or longer.
        directions: Unit vectors of the forces, shape (c, 3).
        forces: Forces of the loads, shape (c,) [N].
    """

    starts: Ints
    ends: Ints
    vertices: Ints
    weights: Floats
    directions: Floats
    forces: Floats

    @classmethod
    def of(cls, loads: Sequence[Load]) -> LoadArrays:
        """Return the given loads as arrays."""
        if isinstance(loads, Loads):
            return loads.arrays
        bounds = np.zeros(len(loads) + 1, dtype=np.int64)
        if not loads:
            nothing = np.zeros(0)
            return cls(bounds[:0], bounds[:0], bounds[:0], nothing, np.zeros((0, 3)), nothing)
        np.cumsum([len(load.vertices) for load in loads], out=bounds[1:])
        return cls(
            bounds[:-1],
            bounds[1:],
            np.concatenate([load.vertices for load in loads]),
            np.concatenate([load.weights for load in loads]),
            np.array([load.direction for load in loads]),
            np.array([load.force for load in loads]),
        )


class Loads(Sequence[Load]):
    """Loads stored as arrays; `Load` objects are made only for a body that reads single loads.

    Args:
        arrays: Arrays of all loads.
    """

    def __init__(self, arrays: LoadArrays) -> None:
        self.arrays = arrays

    @cached_property
    def _loads(self) -> list[Load]:
        starts, ends, vertices, weights, directions, forces = self.arrays
        # Loads of one contact get the same array objects: a body recognises a contact by them.
        parts = {
            a: (vertices[a:b], weights[a:b])
            for a, b in zip(starts.tolist(), ends.tolist(), strict=True)
        }
        return [
            Load(*parts[a], direction, force)
            for a, direction, force in zip(
                starts.tolist(), directions, forces.tolist(), strict=True
            )
        ]

    def __len__(self) -> int:
        return len(self.arrays.forces)

    @overload
    def __getitem__(self, at: int, /) -> Load: ...
    @overload
    def __getitem__(self, at: slice, /) -> Sequence[Load]: ...
    def __getitem__(self, at: int | slice, /) -> Load | Sequence[Load]:
        return self._loads[at]


class Response(Protocol):
    """The response of a body to loads; its values may be computed when they are first read."""

    @property
    def compliance(self) -> Floats:
        """Compliance C between the contacts of the loads, shape (c, c) [m/N].

        C_ij is the displacement of contact i along its direction per unit force at contact j;
        displacement and force are weighted by the pressure profile.
        """
        ...

    @property
    def energy(self) -> float:
        """Elastic energy that the loads have stored in the body [J]."""
        ...

    @property
    def displacement(self) -> Floats:
        """Displacement of every vertex under all loads, shape (n, 3) [m].

        On a large body this takes too long for every tick; use `at`.
        """
        ...

    def displacement_of(self, vertices: Ints) -> Floats:
        """Return the displacement of some vertices under all loads, shape (k, 3) [m]."""
        ...

    def without(self, loads: slice, forces: Floats, vertices: Ints) -> Floats:
        """Return the displacement of some vertices without some of the loads (science 3.3).

        Args:
            loads: Range of the loads to leave out.
            forces: Forces to subtract from those loads, shape (l,) [N].
            vertices: Vertices whose displacement the caller needs, shape (k,).

        Returns:
            Displacement, shape (k, 3) [m].
        """
        ...


@dataclass(frozen=True, eq=False)
class DenseResponse:
    """A response that stores the values of all vertices, for up to a few thousand vertices.

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
        # Compiled loops need contiguous arrays; a body may pass arrays in another memory order.
        for name in ("displacement", "fields"):
            object.__setattr__(self, name, np.ascontiguousarray(getattr(self, name), np.float64))

    def displacement_of(self, vertices: Ints) -> Floats:
        """Return the displacement of some vertices under all loads, shape (k, 3) [m]."""
        return np.asarray(self.displacement[vertices])

    def without(self, loads: slice, forces: Floats, vertices: Ints) -> Floats:
        """Return the displacement of some vertices without some of the loads, shape (k, 3) [m]."""
        first, last, _ = loads.indices(len(self.fields))
        known = np.array([0, len(vertices)])
        return self.without_own(np.array([first, last]), forces, known, vertices)

    def without_own(self, spans: Ints, forces: Floats, starts: Ints, vertices: Ints) -> Floats:
        """Return each user's free surface at some vertices, as the function `without_own` does."""
        left = np.empty((len(vertices), 3))
        subtract_own(self.displacement, self.fields, spans, forces, starts, vertices, left)
        return left


def without_own(
    response: Response, spans: Ints, forces: Floats, starts: Ints, vertices: Ints
) -> Floats:
    """Return the displacement of some vertices for each user, without that user's loads (3.3).

    Args:
        response: Response of the body to the loads of all users.
        spans: First load of each of n users, then the end of the last user's loads, (n + 1,).
        forces: Forces to subtract from these loads, shape (spans[n] - spans[0],) [N].
        starts: Start of each user's part of `vertices`, then the end of the last part, (n + 1,).
        vertices: Vertices at which the displacement is computed, user after user, shape (k,).

    Returns:
        Displacement, shape (k, 3) [m].
    """
    if isinstance(response, DenseResponse):
        return response.without_own(spans, forces, starts, vertices)
    left, loads, places = np.empty((len(vertices), 3)), spans.tolist(), starts.tolist()
    for (a, b), (c, d) in zip(pairwise(loads), pairwise(places), strict=True):
        own = forces[a - loads[0] : b - loads[0]]
        left[c:d] = response.without(slice(a, b), own, vertices[c:d])
    return left


class Body(Protocol):
    """An elastic body that gets forces and returns displacements (an admittance, section 1).

    Every implementation keeps the invariants of science 3.6: C is symmetric and positive definite,
    a rigid motion stores no energy, and the hands' work is never less than the energy stored.
    `cohaptic_server.testing.check_body` checks these invariants.
    """

    @property
    def name(self) -> str:
        """Name of the body, shown to users and sent over the network."""
        ...

    @property
    def mesh(self) -> SurfaceMesh:
        """Surface of the body at rest."""
        ...

    @property
    def contact_radius(self) -> float:
        """Radius of the pressure under a contact [m]."""
        ...

    @property
    def linear(self) -> bool:
        """Whether the body is a linear spring.

        Its displacement is then the sum of those of the present loads, whatever came before. Only
        on such a body do clients move models of the other hands (science 3.15); on others, hands
        feel each other through the room's lag. A body without this attribute is not linear.
        """
        ...

    def respond(self, loads: Sequence[Load], before: Response | None = None) -> Response:
        """Return the body's response to `loads` in one tick.

        Args:
            loads: Loads of the present contacts; a load of zero force has a compliance, too.
            before: Response of the previous tick, from which an iterative or viscous body starts;
                None starts from rest.
        """
        ...


@runtime_checkable
class Prefetching(Protocol):
    """A body that responds better if it knows which vertices fingers will press soon."""

    def prefetch(self, vertices: Ints) -> None:
        """Announce the vertices that sliding fingers will press soon, shape (k,)."""
        ...


@runtime_checkable
class Wrapping(Protocol):
    """A body that adds viscosity or mass to another body."""

    @property
    def elastic(self) -> Body:
        """The body to which viscosity or mass is added."""
        ...


def elastic_of(body: Body) -> Body:
    """Return the elastic body inside a wrapper that adds viscosity or mass, or `body` itself."""
    return body.elastic if isinstance(body, Wrapping) else body


def is_linear(body: Body) -> bool:
    """Return whether a body says that it is a linear spring; one that does not say so is not."""
    return getattr(body, "linear", False) is True


class SwingingResponse(Response, Protocol):
    """Response of a body with mass: hands feel a share of the swing, and users see all of it."""

    @property
    def along(self) -> Floats:
        """Static amplitude of each mode per unit force of a load, shape (loads, k) [sqrt(m/N)]."""
        ...

    @property
    def felt(self) -> float:
        """Share of the swing that hands feel, 0 to 1."""
        ...

    def showing(self, fraction: float) -> Response:
        """Return a copy of the response for the next tick, with a new value of `felt`.

        Args:
            fraction: Share of the swing that hands feel, 0 to 1.
        """
        ...


@runtime_checkable
class Swings(Protocol):
    """A body with mass, whose natural modes swing."""

    @property
    def swing(self) -> Swing:
        """Largest swing of any mode per static amplitude, for each frequency of the force."""
        ...

    def swinging(self, response: Response) -> SwingingResponse | None:
        """Return the response if this body made it; None for a response of another body."""
        ...
