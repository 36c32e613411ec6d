"""Finds the contacts of all users on their tracked surfaces, one after the other in one call.

A tracked surface follows a user's free surface with a delay (`contact_tracking.RELAXATION`). Data
of varying length lie in one array, user after user: an array of starts holds where each user's part
begins, and where the last one ends.
"""

from __future__ import annotations

from cohaptic_server.mesh.search.contact_search import ContactSearch
from cohaptic_server.mesh.search.loaded_field import LoadedField
from cohaptic_server.numeric import Floats, Ints
from cohaptic_server.world.loops.rows import ContactRows, FieldRows, check_rows, same

_UNKNOWN = -1  # `contact_search.UNKNOWN`


# Above 60 lines: the steps for one user share their bounds in the arrays; half are docs.
def track(
    search: ContactSearch,
    field: LoadedField,
    first: int,
    before: Ints,
    tips: Floats,
    fractions: Floats,
    reach: Reach,
    old: ContactRows,
    free: FieldRows,
    surface_of: Ints,
    surfaces: FieldRows,
    followed: Floats,
    new: ContactRows,
    places: Floats,
) -> int:
    """Move each user's tracked surface towards the free surface, and find the contact on it.

    Args:
        search: Contact search on the resting surface.
        field: Displacement field that the search reads.
        first: Row of the user to begin with.
        before: Row of each user in the last tick, -1 for none, shape (n,).
        tips: Points to which the contacts shall be nearest, shape (n, 3) [m].
        fractions: Share of the way to the free surface that each tracked surface moves, 0 to 1,
            shape (n,).
        reach: Radius of the pressure, and how exact a contact has to be.
        old: Contacts of the last tick.
        free: Free surfaces of the last tick, k vertices in all.
        surface_of: Row of the tracked surface of each user of the last tick, -1 for none, shape
            (m,).
        surfaces: Tracked surfaces of the last tick.
        followed: Set to the tracked surfaces of this tick, at the vertices of `free`, shape (k, 3)
            [m].
        new: Set to the new contacts.
        places: Set to the contact points on the free surfaces, shape (n, 3) [m].

    Returns:
        Row of the user at which the loop stopped: n at the end, or the row of a user whose contact
        needs longer arrays, who was not there in the last tick, or whose surface is not stored at a
        needed vertex.

    Raises:
        ValueError: An array has another type or shape.
    """
    n = new.n
    for length in (before.shape[0], tips.shape[0], fractions.shape[0], places.shape[0]):
        same("rows before, tips, shares or places", length, n)
    same("axes of a tip", tips.shape[1], 3)
    same("axes of a place", places.shape[1], 3)
    same("axes of a followed displacement", followed.shape[1], 3)
    same("followed displacements", followed.shape[0], free.values.shape[0])
    check_rows(before, min(old.n, min(free.n, surface_of.shape[0])))
    check_rows(surface_of, surfaces.n)
    for i in range(first, n):
        row = before[i]
        if row < 0:
            return i
        a, b = free.starts[row], free.starts[row + 1]
        if a == b:
            return i
        relax(
            field, free.vertices[a:b], free.values[a:b], int(surface_of[row]), surfaces,
            fractions[i], followed[a:b],
        )  # fmt: skip
        field.load(free.vertices[a:b], followed[a:b], False)
        c, d = old.starts[row], old.starts[row + 1]
        search.take(old.frames[row], float(old.slopes[row]), old.vertices[c:d], old.weights[c:d])
        x, y, z = tips[i, 0], tips[i, 1], tips[i, 2]
        state = search.locate(x, y, z, reach.radius, True, reach.keep, reach.tolerance)
        c = new.starts[i]
        if state == _UNKNOWN or c + search.count > new.vertices.shape[0]:
            return i
        # The contact point is put on the free surface, not on the relaxed one.
        field.load(free.vertices[a:b], free.values[a:b], False)
        search.put(places[i])
        if field.lacking:
            return i
        new.starts[i + 1] = c + search.count
        search.store(new.frames[i], new.vertices[c:], new.weights[c:])
        new.slopes[i] = search.slope
    return n


class Reach:
    """How far a contact's pressure reaches, and how exact the contact has to be.

    Args:
        radius: Radius of the pressure [m].
        keep: Offset of a tip beside the normal up to which the last contact is kept [m].
        tolerance: Offset beside the normal that may remain when a contact is found anew [m].
    """

    def __init__(self, radius: float, keep: float, tolerance: float) -> None:
        self.radius = radius
        self.keep = keep
        self.tolerance = tolerance


def relax(
    field: LoadedField,
    known: Ints,
    free: Floats,
    of: int,
    surfaces: FieldRows,
    fraction: float,
    followed: Floats,
) -> None:
    """Move a tracked surface by `fraction` towards the free one; copy the free one for a new user.

    Args:
        field: Displacement field, used as working memory.
        known: Vertices of the free surface, shape (k,).
        free: Displacement of the free surface at these vertices, shape (k, 3) [m].
        of: Row of the tracked surface; negative for a new user.
        surfaces: Tracked surfaces of the last tick.
        fraction: Share of the way to the free surface, 0 to 1.
        followed: Set to the moved surface at the vertices `known`, shape (k, 3) [m].
    """
    if of < 0:
        for k in range(known.shape[0]):
            for axis in range(3):
                followed[k, axis] = free[k, axis]
        return
    a, b = surfaces.starts[of], surfaces.starts[of + 1]
    field.load(surfaces.vertices[a:b], surfaces.values[a:b], False)
    field.follow(known, free, fraction, followed)
