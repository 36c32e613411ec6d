"""A displacement of the surface, given where somebody asks.

A tick looks at the surface round its contacts only, so that its cost does not grow with the mesh.
What is near a contact is found at once for all of its readers (`Window`); what lies outside is
still there, and costs its own way.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from cohaptic_server.bodies.body import Response
from cohaptic_server.numeric import Floats, Ints


class Field(Protocol):
    """Displacement of vertices by their number; an array of shape (n, 3) is one."""

    def __getitem__(self, vertices: Ints, /) -> Floats:
        """Of some vertices, in an array of any shape (...); shape (..., 3) [m]."""
        ...


class Still:
    """A body that nobody has touched yet."""

    def __getitem__(self, vertices: Ints, /) -> Floats:
        """Nothing is displaced."""
        return np.zeros((*vertices.shape, 3))


@dataclass(frozen=True, eq=False)
class FreeOf:
    """The surface without one user's own force (science 3.3).

    Args:
        response: Of the body to everybody.
        forces: The user's own, one for each of its loads, shape (k,) [N].
        loads: Which of the response's loads are its own; none gives the surface as it is.
    """

    response: Response
    forces: Floats
    loads: slice

    def __getitem__(self, vertices: Ints, /) -> Floats:
        """Of some vertices, shape (..., 3) [m]."""
        where = np.unique(vertices)
        return np.asarray(self.on(where)[np.searchsorted(where, vertices)])

    def on(self, vertices: Ints) -> Floats:
        """Of vertices that rise, shape (k, 3) [m]."""
        return self.response.without(self.loads, self.forces, vertices)


@dataclass(frozen=True, eq=False)
class Window:
    """A field whose values round a contact are known.

    Args:
        vertices: That are known, rising, shape (k,).
        values: Their displacement, shape (k, 3) [m].
        beyond: The field elsewhere.
    """

    vertices: Ints
    values: Floats
    beyond: Field

    def __getitem__(self, vertices: Ints, /) -> Floats:
        """Of some vertices, shape (..., 3) [m]."""
        if vertices is self.vertices:
            return self.values
        if not len(self.vertices):
            return self.beyond[vertices]
        # Takes that clip, since half of a tick's time is spent here and in the like of it.
        place = self.vertices.searchsorted(vertices)
        missing = self.vertices.take(place, mode="clip") != vertices
        found = self.values.take(place, 0, mode="clip")
        if missing.any():
            found[missing] = self.beyond[vertices[missing]]
        return np.asarray(found)
