"""Chooses the windows round the contacts of all users, one after the other in one call."""

from __future__ import annotations

from cohaptic_server.mesh.search.point_tree import PointTree
from cohaptic_server.mesh.search.window_vertices import WindowVertices
from cohaptic_server.numeric import Floats, Ints

_PLANE, _MESH = 1, 3  # values of `cohaptic.protocol.patch.Geometry`


# The arrays hold the data of all users; all steps for one user need the same bounds in the arrays.
def choose_windows(
    surface: PointTree,
    finder: WindowVertices | None,
    found: Ints,
    found_fitted: Ints,
    found_touched: Ints,
    found_carried: Ints,
    first: int,
    geometry: Ints,
    frames: Floats,
    slides: Floats,
    directions: Floats,
    horizons: Floats,
    lengths: Floats,
    half_widths: Floats,
    radius: float,
    reach: float,
    step: float,
    most: int,
    reuse: float,
    speeding_up: float,
    before: Ints,
    old_geometry: Ints,
    old_keys: Floats,
    old_starts: Ints,
    old_vertices: Ints,
    old_fitted: Ints,
    old_touched: Ints,
    old_carried: Ints,
    keys: Floats,
    starts: Ints,
    vertices: Ints,
    fitted: Ints,
    touched: Ints,
    carried: Ints,
) -> int:
    """Copy each window of the last tick that still suffices, and choose the others anew.

    Args:
        surface: Tree of the n vertices of the surface.
        finder: Finder of windows on the touch mesh; None if all patches are planes.
        found: Buffer in which the search leaves the vertices of one window, shape (n,).
        found_fitted, found_touched, found_carried: Buffers in which the finder leaves the other
            parts of one window.
        first: Row of the user to begin with.
        geometry: Geometry of the users' patches, shape (u,).
        frames: Frames of the contacts, shape (u, 3, 3).
        slides: Slide of each probe along the surface while its patch is in use, shape (u, 3) [m].
        directions: Tangential velocities, shape (u, 3) [m/s].
        horizons: Time for which the patches are in use, shape (u,) [s].
        lengths, half_widths: Length of the path ahead of each contact, and distance from the path
            within which a mesh patch needs vertices, shape (u,) each [m].
        radius, reach, step, most: As in `WindowVertices.choose`.
        reuse: Largest move of a contact along each axis at which its window is reused [m].
        speeding_up: Widening of a window per second of a longer horizon [m/s].
        before: Row of each user in the last tick, -1 for none, shape (u,).
        old_geometry, old_keys, old_starts, old_vertices, old_fitted, old_touched, old_carried:
            Windows of the last tick, as in `Windows`.
        keys, starts, vertices, fitted, touched, carried: Set to the windows of this tick.

    Returns:
        Row of the user at which the loop stopped: u at the end, or the row of a user whose window
        does not fit into the arrays.
    """
    for i in range(first, geometry.shape[0]):
        row = before[i]
        a, c, e = starts[0, i], starts[1, i], starts[2, i]
        if (
            row >= 0
            and old_geometry[row] == geometry[i]
            and covers(old_keys, row, frames, slides, horizons, i, speeding_up, reuse)
        ):
            if not copied(
                row, old_starts, old_vertices, old_fitted, old_touched, old_carried, i, starts,
                vertices, fitted, touched, carried,
            ):  # fmt: skip
                return i
            for k in range(7):
                keys[i, k] = old_keys[row, k]
            continue
        fits = carries = 0
        if geometry[i] == _PLANE or finder is None:
            count = surface.within(frames[i, 0, 0], frames[i, 0, 1], frames[i, 0, 2], radius, found)
            surface.sort(found, count)
        else:
            finder.choose(
                frames[i, 0], frames[i, 2], radius, reach, directions[i], lengths[i], step,
                half_widths[i], most if geometry[i] == _MESH else 0,
            )  # fmt: skip
            count, fits, carries = finder.count, finder.fits, finder.carries
        # Checking one array is enough: no part of a window has more vertices than the whole.
        if a + count > vertices.shape[0]:
            return i
        for k in range(count):
            vertices[a + k] = found[k]
        for k in range(fits):
            fitted[c + k] = found_fitted[k]
        for k in range(carries):
            touched[e + k] = found_touched[k]
            carried[e + k] = a + found_carried[k]
        starts[0, i + 1], starts[1, i + 1], starts[2, i + 1] = a + count, c + fits, e + carries
        for k in range(3):
            keys[i, k] = frames[i, 0, k]
            keys[i, 3 + k] = slides[i, k]
        keys[i, 6] = horizons[i]
    return int(geometry.shape[0])


def covers(
    keys: Floats, row: int, frames: Floats, slides: Floats, horizons: Floats, i: int,
    speeding_up: float, reuse: float,
) -> bool:  # fmt: skip
    """Return whether the window in row `row` of the last tick still suffices for contact `i`."""
    if not speeding_up * abs(horizons[i] - keys[row, 6]) <= reuse:
        return False
    for k in range(3):
        moved, turned = frames[i, 0, k] - keys[row, k], slides[i, k] - keys[row, 3 + k]
        if not (abs(moved) <= reuse and abs(turned) <= reuse):
            return False
    return True


def copied(
    row: int, old_starts: Ints, old_vertices: Ints, old_fitted: Ints, old_touched: Ints,
    old_carried: Ints, i: int, starts: Ints, vertices: Ints, fitted: Ints, touched: Ints,
    carried: Ints,
) -> bool:  # fmt: skip
    """Copy the window in row `row` of the last tick; return False if the arrays are too short."""
    for part in range(3):
        size = old_starts[part, row + 1] - old_starts[part, row]
        if starts[part, i] + size > vertices.shape[0]:
            return False
        starts[part, i + 1] = starts[part, i] + size
    a, b = starts[0, i], old_starts[0, row]
    shift = a - b
    for k in range(starts[0, i + 1] - a):
        vertices[a + k] = old_vertices[b + k]
    a, b = starts[1, i], old_starts[1, row]
    for k in range(starts[1, i + 1] - a):
        fitted[a + k] = old_fitted[b + k]
    a, b = starts[2, i], old_starts[2, row]
    for k in range(starts[2, i + 1] - a):
        touched[a + k] = old_touched[b + k]
        carried[a + k] = old_carried[b + k] + shift
    return True
