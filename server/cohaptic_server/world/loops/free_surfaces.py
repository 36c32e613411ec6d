"""Contact points and bulges on each user's free surface: the surface without that user's force."""

from __future__ import annotations

from cohaptic_server.mesh.search.bulge_fit import fit_bulge
from cohaptic_server.mesh.search.contact_search import ContactSearch
from cohaptic_server.mesh.search.loaded_field import LoadedField
from cohaptic_server.numeric import Floats, Ints


def put_contacts(
    search: ContactSearch,
    field: LoadedField,
    first: int,
    frames: Floats,
    starts: Ints,
    under: Ints,
    weights: Floats,
    known_starts: Ints,
    known: Ints,
    values: Floats,
    places: Floats,
) -> int:
    """Compute the contact point of each user on the user's free surface.

    Args:
        search: Contact search on the resting surface.
        field: Displacement field that the search reads.
        first: Row of the user to begin with.
        frames, starts, under, weights: Contacts, as in `Contacts`.
        known_starts, known: Vertices at which each user's surface is stored, shape (k,).
        values: Displacement of the surface at these vertices, shape (k, 3) [m].
        places: Set to the contact points, shape (n, 3) [m].

    Returns:
        Row of the user at which the loop stopped: n at the end, or the row of a user whose surface
        is not stored at some vertex under the contact.
    """
    for i in range(first, frames.shape[0]):
        a, b, c, d = known_starts[i], known_starts[i + 1], starts[i], starts[i + 1]
        field.load(known[a:b], values[a:b], False)
        search.take(frames[i], 1.0, under[c:d], weights[c:d])
        search.put(places[i])
        if field.lacking:
            return i
    return int(frames.shape[0])


def flatten(
    rest: Floats,
    normals: Floats,
    frames: Floats,
    x_free: Floats,
    depths: Floats,
    radius: float,
    largest: float,
    matrix: Floats,
    known_starts: Ints,
    known: Ints,
    values: Floats,
    shown: Floats,
) -> None:
    """Flatten bulges off which probes would slide, for `displacement_field.flatten_bulges`.

    Args:
        rest: Resting positions, shape (v, 3) [m].
        normals: Resting normals, shape (v, 3).
        frames: Frames of the contacts, shape (n, 3, 3).
        x_free: Contact points on their surfaces, shape (n, 3) [m].
        depths: Depths of the probes below these points, shape (n,) [m].
        radius: Radius of the fit of a bulge [m].
        largest: Product of depth and curvature up to which a bulge stays as it is.
        matrix: Working memory of `fit_bulge`, shape (6, 8).
        known_starts, known: Vertices at which each user's surface is stored, shape (k,).
        values: Displacement at these vertices, flattened in place, shape (k, 3) [m].
        shown: Set to the displacement of each contact [m], and the factor by which differences from
            it were multiplied, 1 for a surface that stays as it is, shape (n, 4).
    """
    for i in range(frames.shape[0]):
        shown[i, 3] = 1.0
        for axis in range(3):
            shown[i, axis] = x_free[i, axis] - frames[i, 1, axis]
        if not depths[i] > 0.0:
            continue
        a, b = known_starts[i], known_starts[i + 1]
        sharp = fit_bulge(rest, normals, known[a:b], values[a:b], frames[i], radius, matrix)
        if depths[i] * sharp <= largest:
            continue
        share = largest / (depths[i] * sharp)
        shown[i, 3] = share
        for k in range(a, b):
            for axis in range(3):
                moved = shown[i, axis]
                values[k, axis] = moved + share * (values[k, axis] - moved)
