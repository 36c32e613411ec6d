"""Fields: the displacement of the surface, computed only at vertices that a caller names.

A tick computes the surface round its contacts only, so that its cost does not grow with the mesh.
The values of vertices near a contact are computed once and stored (`CachedField`); the values of
other vertices are computed at each call.

A patch shows the free surface round a contact as it is, except for a bulge off which the probe
would slide. When two fingers pinch a thin part, the free surface of each finger has the bulge that
the other finger would make alone: on a plate 3 mm thick that 1.5 N pinch by 1 mm, the bulge is
18 mm high and as sharp as a fingertip, while the plate itself stays flat. A probe that lies deeper
below a bulge than the bulge's radius of curvature has its nearest point beside the bulge: the two
contacts run away from each other, and come back a loop delay later. In the theory of small
displacements no surface turns so far. The patch therefore shows the bulge flatter around the
contact; the position and the compliance of the contact stay as they are.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np

from cohaptic_server.bodies.body import Response
from cohaptic_server.mesh import curvature
from cohaptic_server.mesh.surface import SurfaceMesh
from cohaptic_server.numeric import Floats, Ints
from cohaptic_server.world.loops.free_surfaces import flatten
from cohaptic_server.world.loops.rows import FieldRows

# Largest product q of the depth of a probe and the curvature of the bulge over it. A contact moves
# by q / (1 - q) of the distance that the contact on the other side moves: by a third here, so that
# both come to rest whatever the delay. From q = 1/2 on the two drive each other away
# (tests/system/test_thin_parts.py).
LARGEST_PRODUCT = 0.25
_BULGE_ROOM = np.zeros((6, 8))  # working memory for one bulge after the other


class Field(Protocol):
    """Displacement of the surface at any vertices; an array of shape (n, 3) is such a field."""

    def __getitem__(self, vertices: Ints, /) -> Floats:
        """Return the displacement of `vertices`, of any shape (...), shape (..., 3) [m]."""
        ...


class ZeroField:
    """Displacement of a body without any load: zero at all vertices."""

    def __getitem__(self, vertices: Ints, /) -> Floats:
        """Return zeros for `vertices`, of any shape (...), shape (..., 3) [m]."""
        return np.zeros((*vertices.shape, 3))


@dataclass(frozen=True, eq=False)
class FreeField:
    """Displacement of the surface without one user's own force (science 3.3).

    Args:
        response: Response of the body to all loads.
        forces: Magnitudes of the user's own loads, shape (k,) [N].
        loads: Position of these loads among the response's loads; an empty slice gives the
            displacement with every force.
    """

    response: Response
    forces: Floats
    loads: slice

    def __getitem__(self, vertices: Ints, /) -> Floats:
        """Return the displacement of `vertices`, of any shape (...), shape (..., 3) [m]."""
        ascending = np.unique(vertices)
        return np.asarray(self.on(ascending)[np.searchsorted(ascending, vertices)])

    def on(self, vertices: Ints) -> Floats:
        """Return the displacement of vertices in ascending order, shape (k, 3) [m]."""
        return self.response.without(self.loads, self.forces, vertices)


@dataclass(frozen=True, eq=False)
class CachedField:
    """A field with stored values for some vertices.

    Args:
        vertices: Vertices whose values are stored, ascending, shape (k,).
        values: Displacement of these vertices, shape (k, 3) [m].
        elsewhere: Field that gives the displacement of all other vertices.
    """

    vertices: Ints
    values: Floats
    elsewhere: Field

    def __getitem__(self, vertices: Ints, /) -> Floats:
        """Return the displacement of `vertices`, of any shape (...), shape (..., 3) [m]."""
        if vertices is self.vertices:
            return self.values
        if not len(self.vertices):
            return self.elsewhere[vertices]
        # `take` with clipping is the fastest look-up; look-ups take half of a tick's time.
        position = self.vertices.searchsorted(vertices)
        missing = self.vertices.take(position, mode="clip") != vertices
        displacement = self.values.take(position, 0, mode="clip")
        if missing.any():
            displacement[missing] = self.elsewhere[vertices[missing]]
        return np.asarray(displacement)


class KnownFields(NamedTuple):
    """Fields of several users, each stored for some vertices, as arrays for compiled loops.

    Args:
        starts: Where each user's vertices begin, and where the last ones end, shape (n + 1,).
        vertices: Vertices of each user, ascending, shape (k,) or longer.
        values: Displacement of these vertices, shape (k, 3) or longer [m].
    """

    starts: Ints
    vertices: Ints
    values: Floats


NOWHERE_KNOWN = KnownFields(
    np.zeros(1, dtype=np.int64), np.zeros(0, dtype=np.int64), np.zeros((0, 3))
)  # fields of no users


@dataclass(frozen=True, eq=False)
class FlatterField:
    """A field flattened round a contact: moved + share (field - moved).

    Args:
        field: Field before the flattening.
        moved: Displacement of the contact, shape (3,) [m].
        fraction: Factor of the differences from `moved`, 0 to 1.
    """

    field: Field
    moved: Floats
    fraction: float

    def __getitem__(self, vertices: Ints, /) -> Floats:
        """Return the displacement of `vertices`, of any shape (...), shape (..., 3) [m]."""
        return np.asarray(self.moved + self.fraction * (self.field[vertices] - self.moved))


def flatten_bulges(
    mesh: SurfaceMesh,
    fields: KnownFields,
    frames: Floats,
    x_free: Floats,
    depths: Floats,
    contact_radius: float,
) -> Floats:
    """Flatten the free surface round each contact where its probe would slide off a bulge.

    A surface on which the contact is stable stays as it is. Only surfaces that other users bend as
    sharply as a fingertip are flattened.

    Args:
        mesh: Resting surface.
        fields: Displacement of each user's surface without its own force; flattened in place.
        frames: Foot, point and normal of each contact, shape (n, 3, 3).
        x_free: Contact points on these surfaces, which stay where they are, shape (n, 3) [m].
        depths: Depths of the probes below these points; at 0 nothing is flattened, shape (n,) [m].
        contact_radius: Radius of the pressure under a contact [m].

    Returns:
        Displacement of each contact [m], and the factor by which differences from that displacement
        were multiplied, 1 for a surface that stays as it is; shape (n, 4).
    """
    shown = np.empty((len(frames), 4))
    radius = curvature.fit_radius(mesh, contact_radius)
    flatten(
        mesh.vertices, mesh.normals, frames, x_free, depths, radius, LARGEST_PRODUCT,
        _BULGE_ROOM, FieldRows(*fields), shown,
    )  # fmt: skip
    return shown
