"""Displacement of the surface, evaluated only at the vertices that are asked for.

A tick evaluates the surface round its contacts only, so that its cost does not grow with the mesh.
Vertices near a contact are evaluated once for all readers (`CachedField`); others are evaluated
each time that they are asked for.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from cohaptic_server.bodies.body import Response
from cohaptic_server.numeric import Floats, Ints


class Field(Protocol):
    """Displacement by vertex number; an array of shape (n, 3) is such a field."""

    def __getitem__(self, vertices: Ints, /) -> Floats:
        """Displacement at vertices of any shape (...), shape (..., 3) [m]."""
        ...


class ZeroField:
    """Displacement of a body that nobody has touched yet."""

    def __getitem__(self, vertices: Ints, /) -> Floats:
        """Zeros, shape (..., 3) [m]."""
        return np.zeros((*vertices.shape, 3))


@dataclass(frozen=True, eq=False)
class FreeField:
    """Displacement of the surface without one user's own force (science 3.3).

    Args:
        response: Of the body to everybody.
        forces: Magnitudes of the user's own loads, shape (k,) [N].
        loads: Position of these loads among the response's; an empty slice gives the displacement
            with every force.
    """

    response: Response
    forces: Floats
    loads: slice

    def __getitem__(self, vertices: Ints, /) -> Floats:
        """Displacement at vertices of any shape (...), shape (..., 3) [m]."""
        ascending = np.unique(vertices)
        return np.asarray(self.on(ascending)[np.searchsorted(ascending, vertices)])

    def on(self, vertices: Ints) -> Floats:
        """Displacement at vertices in ascending order, shape (k, 3) [m]."""
        return self.response.without(self.loads, self.forces, vertices)


@dataclass(frozen=True, eq=False)
class CachedField:
    """A field with known values round a contact.

    Args:
        vertices: Whose values are known, ascending, shape (k,).
        values: Their displacement, shape (k, 3) [m].
        elsewhere: Field that answers for all other vertices.
    """

    vertices: Ints
    values: Floats
    elsewhere: Field

    def __getitem__(self, vertices: Ints, /) -> Floats:
        """Displacement at vertices of any shape (...), shape (..., 3) [m]."""
        if vertices is self.vertices:
            return self.values
        if not len(self.vertices):
            return self.elsewhere[vertices]
        # `take` with clipping is the fastest lookup: half of a tick's time is spent in such ones.
        position = self.vertices.searchsorted(vertices)
        missing = self.vertices.take(position, mode="clip") != vertices
        displacement = self.values.take(position, 0, mode="clip")
        if missing.any():
            displacement[missing] = self.elsewhere[vertices[missing]]
        return np.asarray(displacement)
