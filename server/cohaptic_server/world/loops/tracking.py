"""Finds the contacts of all users on their tracked surfaces, one after the other in one call.

A tracked surface follows a user's free surface with a delay (`contact_tracking.RELAXATION`). Data
of varying length lie in one array, user after user: an array of starts holds where each user's part
begins, and where the last one ends.
"""

from __future__ import annotations

from cohaptic_server.mesh.search.contact_search import ContactSearch
from cohaptic_server.mesh.search.loaded_field import LoadedField
from cohaptic_server.numeric import Floats, Ints

_UNKNOWN = -1  # `contact_search.UNKNOWN`


# The arrays hold the data of all users; all steps for one user need the same bounds in the arrays.
def track(
    search: ContactSearch,
    field: LoadedField,
    first: int,
    before: Ints,
    tips: Floats,
    shares: Floats,
    radius: float,
    keep: float,
    tolerance: float,
    frames: Floats,
    slopes: Floats,
    starts: Ints,
    under: Ints,
    weights: Floats,
    known_starts: Ints,
    known: Ints,
    free: Floats,
    surface_of: Ints,
    surface_starts: Ints,
    surface_known: Ints,
    surface: Floats,
    followed: Floats,
    new_frames: Floats,
    new_slopes: Floats,
    new_starts: Ints,
    new_under: Ints,
    new_weights: Floats,
    places: Floats,
) -> int:
    """Move each user's tracked surface towards the free surface, and find the contact on it.

    Args:
        search: Contact search on the resting surface.
        field: Displacement field that the search reads.
        first: Row of the user to begin with.
        before: Row of each user in the last tick, -1 for none, shape (n,).
        tips: Points to which the contacts shall be nearest, shape (n, 3) [m].
        shares: Share of the way to the free surface that each tracked surface moves, 0 to 1, shape
            (n,).
        radius: Radius of the pressure [m].
        keep: Offset of a tip beside the normal up to which the last contact is kept [m].
        tolerance: Offset beside the normal that may remain when a contact is found anew [m].
        frames, slopes, starts, under, weights: Contacts of the last tick, as in `Contacts`.
        known_starts, known: Vertices at which each user's free surface of the last tick is stored.
        free: Displacement of the free surface at these vertices, shape (k, 3) [m].
        surface_of: Row of the tracked surface of each user of the last tick, -1 for none, shape
            (m,).
        surface_starts, surface_known, surface: Tracked surfaces of the last tick.
        followed: Set to the tracked surfaces of this tick, at the vertices of `free`, shape (k, 3)
            [m].
        new_frames, new_slopes, new_starts, new_under, new_weights: Set to the new contacts.
        places: Set to the contact points on the free surfaces, shape (n, 3) [m].

    Returns:
        Row of the user at which the loop stopped: n at the end, or the row of a user whose contact
        needs longer arrays, who was not there in the last tick, or whose surface is not stored at a
        needed vertex.
    """
    for i in range(first, before.shape[0]):
        row = before[i]
        if row < 0:
            return i
        a, b = known_starts[row], known_starts[row + 1]
        if a == b:
            return i
        relax(
            field, known[a:b], free[a:b], int(surface_of[row]), surface_starts, surface_known,
            surface, shares[i], followed[a:b],
        )  # fmt: skip
        field.load(known[a:b], followed[a:b], False)
        c, d = starts[row], starts[row + 1]
        search.take(frames[row], float(slopes[row]), under[c:d], weights[c:d])
        x, y, z = tips[i, 0], tips[i, 1], tips[i, 2]
        state = search.locate(x, y, z, radius, True, keep, tolerance)
        c = new_starts[i]
        if state == _UNKNOWN or c + search.count > new_under.shape[0]:
            return i
        # The contact point is put on the free surface, not on the relaxed one.
        field.load(known[a:b], free[a:b], False)
        search.put(places[i])
        if field.lacking:
            return i
        new_starts[i + 1] = c + search.count
        search.give(new_frames[i], new_under[c:], new_weights[c:])
        new_slopes[i] = search.slope
    return int(before.shape[0])


def relax(
    field: LoadedField,
    known: Ints,
    free: Floats,
    of: int,
    starts: Ints,
    surface_known: Ints,
    surface: Floats,
    share: float,
    followed: Floats,
) -> None:
    """Move a tracked surface by `share` towards the free one; copy the free one for a new user.

    Args:
        field: Displacement field, used as working memory.
        known: Vertices of the free surface, shape (k,).
        free: Displacement of the free surface at these vertices, shape (k, 3) [m].
        of: Row of the tracked surface; negative for a new user.
        starts, surface_known, surface: Tracked surfaces of the last tick.
        share: Share of the way to the free surface, 0 to 1.
        followed: Set to the moved surface at the vertices `known`, shape (k, 3) [m].
    """
    if of < 0:
        for k in range(known.shape[0]):
            for axis in range(3):
                followed[k, axis] = free[k, axis]
        return
    a, b = starts[of], starts[of + 1]
    field.load(surface_known[a:b], surface[a:b], False)
    field.follow(known, free, share, followed)
