"""Contact points and bulges on each user's free surface: the surface without that user's force."""

from __future__ import annotations

from cohaptic_server.mesh.search.bulge_fit import fit_bulge
from cohaptic_server.mesh.search.contact_search import ContactSearch
from cohaptic_server.mesh.search.loaded_field import LoadedField
from cohaptic_server.numeric import Floats
from cohaptic_server.world.loops.rows import ContactRows, FieldRows, same


def put_contacts(
    search: ContactSearch,
    field: LoadedField,
    first: int,
    contacts: ContactRows,
    free: FieldRows,
    places: Floats,
) -> int:
    """Compute the contact point of each user on the user's free surface.

    Args:
        search: Contact search on the resting surface.
        field: Displacement field that the search reads.
        first: Row of the user to begin with.
        contacts: Contacts of the n users.
        free: Free surfaces of the users.
        places: Set to the contact points, shape (n, 3) [m].

    Returns:
        Row of the user at which the loop stopped: n at the end, or the row of a user whose surface
        is not stored at some vertex under the contact.

    Raises:
        ValueError: An array has another type or shape.
    """
    same("free surfaces", free.n, contacts.n)
    same("places", places.shape[0], contacts.n)
    same("axes of a place", places.shape[1], 3)
    for i in range(first, contacts.n):
        a, b, c, d = free.starts[i], free.starts[i + 1], contacts.starts[i], contacts.starts[i + 1]
        field.load(free.vertices[a:b], free.values[a:b], False)
        search.take(contacts.frames[i], 1.0, contacts.vertices[c:d], contacts.weights[c:d])
        search.put(places[i])
        if field.lacking:
            return i
    return contacts.n


def flatten(
    rest: Floats,
    normals: Floats,
    frames: Floats,
    x_free: Floats,
    depths: Floats,
    radius: float,
    largest: float,
    matrix: Floats,
    fields: FieldRows,
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
        fields: Surfaces of the users, flattened in place.
        shown: Set to the displacement of each contact [m], and the factor by which differences from
            it were multiplied, 1 for a surface that stays as it is, shape (n, 4).

    Raises:
        ValueError: An array has another type or shape.
    """
    n = fields.n
    for length in (frames.shape[0], x_free.shape[0], depths.shape[0], shown.shape[0]):
        same("frames, points, depths or results", length, n)
    if frames.shape[1] != 3 or frames.shape[2] != 3 or x_free.shape[1] != 3 or shown.shape[1] != 4:
        raise ValueError("a frame has the shape (3, 3), a point (3,), a result (4,)")
    for i in range(n):
        shown[i, 3] = 1.0
        for axis in range(3):
            shown[i, axis] = x_free[i, axis] - frames[i, 1, axis]
        if not depths[i] > 0.0:
            continue
        a, b = fields.starts[i], fields.starts[i + 1]
        vertices, values = fields.vertices[a:b], fields.values[a:b]
        sharp = fit_bulge(rest, normals, vertices, values, frames[i], radius, matrix)
        if depths[i] * sharp <= largest:
            continue
        fraction = largest / (depths[i] * sharp)
        shown[i, 3] = fraction
        for k in range(b - a):
            for axis in range(3):
                moved = shown[i, axis]
                values[k, axis] = moved + fraction * (values[k, axis] - moved)
