"""A body as fingers touch it: the mesh of its mesh patches, and how soft each of its vertices is.

Both are found at most once for a body, when they are first asked for: a table of compliances may
take a minute, and a room without mesh patches needs none.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Protocol, runtime_checkable

import numpy as np

from cohaptic_server.bodies.body import Body, Load
from cohaptic_server.mesh.pressure import pressure
from cohaptic_server.mesh.touch_mesh import APART, TouchMesh, thinned
from cohaptic_server.numeric import Floats


@runtime_checkable
class Surveyed(Protocol):
    """A body with a quicker way to its table than a response for each vertex."""

    def vertex_compliance(self) -> Floats:
        """C_ii of a contact centred at each vertex, along its normal, shape (n,) [m/N]."""
        ...


@dataclass(frozen=True, eq=False)
class TouchedBody:
    """A body and its surface for fingers.

    Args:
        body: The deformable object.
    """

    body: Body

    @cached_property
    def mesh(self) -> TouchMesh:
        """The mesh that mesh patches are cut out of."""
        return thinned(self.body.mesh, APART * self.body.contact_radius)

    @cached_property
    def vertex_compliance(self) -> Floats:
        """C_ii of a contact centred at each vertex of the whole surface, shape (n,) [m/N].

        Of the body at rest; a patch carries its own c_ii, by which the client scales these.
        """
        return vertex_compliance(self.body)


def vertex_compliance(body: Body) -> Floats:
    """C_ii of a contact centred at each vertex, along its normal, shape (n,) [m/N]."""
    if isinstance(body, Surveyed):
        return body.vertex_compliance()
    mesh = body.mesh
    table = np.empty(len(mesh.vertices))
    for k, (at, normal) in enumerate(zip(mesh.vertices, mesh.normals, strict=True)):
        load = Load(*pressure(mesh, at, body.contact_radius), -normal, 0.0)
        table[k] = max(0.0, body.respond([load]).compliance[0, 0])
    return table
