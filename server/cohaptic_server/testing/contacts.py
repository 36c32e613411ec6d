"""Contacts for checks and tests: finds soft places, measures depths, finds steady states."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Protocol, TypeVar

import numpy as np

from cohaptic_server.bodies.body import Body, Load, Response
from cohaptic_server.mesh.pressure import pressure
from cohaptic_server.mesh.sampling import spread_over
from cohaptic_server.numeric import Floats

_CANDIDATES = 40  # vertices spread over the surface that are tried as contacts
_SOFT = 0.05  # least compliance of a contact over that of the softest candidate

R_co = TypeVar("R_co", bound=Response, covariant=True)


def press_vertex(body: Body, vertex: int, force: float) -> Load:
    """Return a press against the normal, centred at a vertex, with the body's contact radius."""
    mesh = body.mesh
    vertices, weights = pressure(
        mesh, mesh.vertices[vertex], body.contact_radius, mesh.normals[vertex]
    )
    return Load(vertices, weights, -mesh.normals[vertex], force)


def soft_contacts(body: Body, count: int) -> list[Load]:
    """Return presses of zero force, far from each other, where the body is not fixed.

    Raises:
        ValueError: The body has too few such places.
    """
    vertices = spread_over(body.mesh.vertices, _CANDIDATES)
    loads = [press_vertex(body, int(k), 0.0) for k in vertices]
    own = np.array([float(body.respond([load]).compliance[0, 0]) for load in loads])
    soft = [loads[i] for i in np.flatnonzero(own > _SOFT * own.max())]
    if len(soft) < count:
        raise ValueError(f"{body.name} can be pressed at {len(soft)} of {len(loads)} points")
    return soft[:count]


def pressed(loads: Sequence[Load], forces: Sequence[float] | Floats) -> list[Load]:
    """Return the same contacts with other forces [N]."""
    return [replace(load, force=float(force)) for load, force in zip(loads, forces, strict=True)]


def depth(load: Load, response: Response) -> float:
    """Displacement of a contact along its force [m]."""
    return float(load.weights @ (response.at(load.vertices) @ load.direction))


def depths(loads: Sequence[Load], response: Response) -> Floats:
    """Displacement of each contact along its force, shape (c,) [m]."""
    return np.array([depth(load, response) for load in loads])


class Responding(Protocol[R_co]):
    """A body that is generic in the type of its response."""

    @property
    def name(self) -> str:
        """Name of the body for messages."""
        ...

    def respond(self, loads: Sequence[Load], before: Response | None = None) -> R_co:
        """Return the response as `Body.respond` does."""
        ...


def settled(
    body: Responding[R_co],
    loads: Sequence[Load],
    before: Response | None = None,
    *,
    tolerance: float = 1e-11,
    ticks: int = 400,
) -> R_co:
    """Return the steady response to constant loads.

    Args:
        before: Response to start from; None for rest.
        tolerance: Largest change of any vertex in the last tick and in the tick before it, since a
            swinging body is still for a moment where it turns [m].
        ticks: Largest number of ticks.

    Raises:
        AssertionError: The body still moves after that many ticks.
    """
    response, change = body.respond(loads, before), np.inf
    for _ in range(ticks):
        previous, response, last = response, body.respond(loads, response), change
        change = float(np.abs(response.displacement - previous.displacement).max())
        if max(change, last) <= tolerance:
            return response
    raise AssertionError(f"{body.name} still moves {change:g} m in a tick after {ticks} ticks")
