"""Contact of a probe with a body: the contact point, the pressure around it, and the normal.

A contact is found on the surface *free of the client's own force*, so that pressing harder does not
move the contact point. The probe lies on the normal through the contact point; point, displacement
and normal are averaged over the pressure. The nearest point of a faceted surface would jump from
face to face under a probe that sinks in; the average slides smoothly. Points of the surface are
given on the resting mesh, and the search subtracts their displacement from the probe's position.

Facets lie below the smooth surface that they approximate, by half a millimetre on a balloon of 642
vertices. The contact point is therefore lifted to the smooth surface through the vertices with
their normals, so that a hand that slides feels no facets; a client with the resting mesh
(`mesh_surface.py`) finds the same surface.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np

from cohaptic.vec import Vec3
from cohaptic_server.bodies.body import Load
from cohaptic_server.mesh.search.contact_search import KEPT, UNKNOWN
from cohaptic_server.mesh.surface import SurfaceMesh
from cohaptic_server.numeric import Floats, Ints, union, vec3
from cohaptic_server.world.displacement_field import CachedField, Field

# m above the surface; a probe higher up applies no force. At 60 ticks a second a hand is seen below
# this before it touches, also at 1.5 m/s. Reasoned, not measured.
MAX_CONTACT_HEIGHT = 0.03
# m along the surface; a hand that moves is followed again in the next tick. Half of the distance
# below, so that a contact just found is kept. Reasoned, not measured.
TOLERANCE = 3e-5
# m beside the normal within which a previous contact is kept, so that most ticks of a pressing hand
# need no search. This offset turns the force by 0.2 % on a radius of 30 mm, and by 0.8 % on that of
# a fingertip, 8 mm. Reasoned, not measured.
KEEP_DISTANCE = 6e-5
_NO_VERTICES = np.zeros(0, dtype=np.int64)
_NO_VALUES = np.zeros((0, 3))


@dataclass(init=False, eq=False, slots=True)
class Contact:
    """Contact of one probe with a body.

    Args:
        frame: Point on a facet of the resting mesh [m], contact point on the smooth resting surface
            above it [m], and outward unit normal of the free surface, averaged over the pressure;
            shape (3, 3).
        vertices: Vertices under the pressure, rising, shape (k,).
        weights: Share of each vertex in the pressure, shape (k,); they sum to 1.
        slope: Decrease of the probe's offset beside the normal per distance that the contact moves
            along the surface: 1 on a plane, and less where the normal turns, such as at an edge
            under a deep probe.

    Attributes:
        places: The rows of `frame` as tuples: foot [m], contact point [m] and normal.
    """

    frame: Final[Floats]
    vertices: Final[Ints]
    weights: Final[Floats]
    slope: Final[float]
    places: Final[tuple[Vec3, Vec3, Vec3]]

    def __init__(self, frame: Floats, vertices: Ints, weights: Floats, slope: float = 1.0) -> None:
        self.frame = frame
        self.vertices = vertices
        self.weights = weights
        self.slope = slope
        foot, point, normal = frame.tolist()
        self.places = tuple(foot), tuple(point), tuple(normal)

    @property
    def foot(self) -> Floats:
        """Point on a facet of the resting mesh, shape (3,) [m]."""
        return np.asarray(self.frame[0])

    @property
    def point(self) -> Floats:
        """Contact point on the smooth resting surface above the foot, shape (3,) [m]."""
        return np.asarray(self.frame[1])

    @property
    def normal(self) -> Floats:
        """Outward unit normal of the free surface, shape (3,)."""
        return np.asarray(self.frame[2])

    def load(self, force: float) -> Load:
        """Return the load of a normal force `force` [N] on this contact."""
        return Load(self.vertices, self.weights, -self.normal, force)

    def moved(self, displacement: Field) -> Floats:
        """Return the contact point on the surface that `displacement` deforms, shape (3,) [m]."""
        return np.asarray(self.point + self.weights @ displacement[self.vertices])


class Contacts(NamedTuple):
    """Contacts of a room's users as arrays, in the order in which compiled loops take them.

    Args:
        frames: Frame of each contact, as in `Contact`, shape (n, 3, 3).
        slopes: Slope of each contact, shape (n,).
        starts: Where each contact begins in `vertices`, and where the last ends, shape (n + 1,).
        vertices: Vertices under the contacts, user after user, shape (k,) or longer.
        weights: Share of each vertex in its contact's pressure, shape (k,) or longer.
    """

    frames: Floats
    slopes: Floats
    starts: Ints
    vertices: Ints
    weights: Floats

    def contact(self, i: int) -> Contact:
        """Return contact `i`."""
        own = slice(self.starts[i], self.starts[i + 1])
        slope = float(self.slopes[i])
        return Contact(self.frames[i], self.vertices[own], self.weights[own], slope)

    def put(self, i: int, contact: Contact) -> Contacts:
        """Write `contact` to row `i`, after all rows before it; return the contacts.

        The arrays are changed in place; arrays that are too short are replaced by longer ones.
        """
        start, count = int(self.starts[i]), len(contact.vertices)
        self.frames[i], self.slopes[i] = contact.frame, contact.slope
        self.starts[i + 1] = end = start + count
        vertices, weights = self.vertices, self.weights
        if end > len(vertices):
            more = max(count, len(vertices))
            vertices = np.concatenate([vertices, np.empty(more, dtype=np.int64)])
            weights = np.concatenate([weights, np.empty(more)])
        vertices[start:end], weights[start:end] = contact.vertices, contact.weights
        return self._replace(vertices=vertices, weights=weights)

    @property
    def normals(self) -> Floats:
        """Outward unit normals of the free surfaces, shape (n, 3)."""
        return self.frames[:, 2]


NO_CONTACTS = Contacts(
    np.zeros((0, 3, 3)), np.zeros(0), np.zeros(1, dtype=np.int64), _NO_VERTICES, np.zeros(0)
)


def locate(
    mesh: SurfaceMesh,
    probe: Vec3 | Floats,
    free: Field,
    *,
    radius: float,
    hint: Contact | None = None,
    tolerance: float | None = None,
) -> Contact:
    """Find the contact of a probe with the free surface.

    Args:
        mesh: Resting surface.
        probe: Position of the tip [m].
        free: Displacement of the vertices without this probe's own force.
        radius: Radius of the pressure [m].
        hint: Contact of the last tick, where the search starts; None to search the whole surface.
        tolerance: Largest error of the contact along the surface [m]; None takes `TOLERANCE`.
    """
    final, keep = (TOLERANCE, KEEP_DISTANCE) if tolerance is None else (tolerance, tolerance)
    search = mesh.contacts.search
    x, y, z = probe
    known = _known(free)
    state = UNKNOWN
    while state == UNKNOWN:
        mesh.contacts.field.load(*known)
        if hint is not None:
            search.take(hint.frame, hint.slope, hint.vertices, hint.weights)
        state = search.locate(x, y, z, radius, hint is not None, keep, final)
        if state == UNKNOWN:
            known = _wider(mesh, known, free)
    return _found(mesh, hint if state == KEPT else None)


def place_on(mesh: SurfaceMesh, contact: Contact, free: Field) -> Vec3:
    """Return the contact point on a displaced surface [m]; fast if the field is a `CachedField`."""
    if isinstance(free, CachedField):
        search = mesh.contacts.search
        search.take(contact.frame, contact.slope, contact.vertices, contact.weights)
        mesh.contacts.field.load(free.vertices, free.values, False)
        place = mesh.contacts.place
        search.put(place)
        if not mesh.contacts.field.lacking:
            x, y, z = place.tolist()
            return x, y, z
    return vec3(contact.moved(free))


def turned(mesh: SurfaceMesh, contact: Contact, free: Field) -> Contact:
    """Return a copy of a contact with the normal of the surface that is displaced by `free`."""
    search = mesh.contacts.search
    known = _known(free)
    search.take(contact.frame, contact.slope, contact.vertices, contact.weights)
    mesh.contacts.field.load(*known)
    while search.look() == UNKNOWN:
        known = _wider(mesh, known, free)
        mesh.contacts.field.load(*known)
    return _found(mesh, contact)


class _Known(NamedTuple):
    """Values of a field [m] at some vertices, or at all vertices in order if `whole` is true."""

    vertices: Ints
    values: Floats
    whole: bool


def _known(field: Field) -> _Known:
    if isinstance(field, np.ndarray):
        return _Known(_NO_VERTICES, field, True)
    if isinstance(field, CachedField):
        return _Known(field.vertices, field.values, False)
    return _Known(_NO_VERTICES, _NO_VALUES, False)


def _wider(mesh: SurfaceMesh, known: _Known, field: Field) -> _Known:
    """Return the values of a field also at all corners of the faces round the search's contact."""
    found = mesh.contacts
    under = found.under[: found.search.count]
    vertices = union(known.vertices, mesh.faces[mesh.rings[under]].ravel())
    return _Known(vertices, field[vertices], False)


def _found(mesh: SurfaceMesh, same: Contact | None) -> Contact:
    """Return the contact that the search found, with the pressure of `same` unless that is None."""
    found = mesh.contacts
    frame, search = found.frame.copy(), found.search
    if same is not None:
        return Contact(frame, same.vertices, same.weights, search.slope)
    count = search.count
    return Contact(frame, found.under[:count].copy(), found.weights[:count].copy(), search.slope)
