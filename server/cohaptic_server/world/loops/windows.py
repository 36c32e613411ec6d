"""Chooses the windows round the contacts of all users, one after the other in one call."""

from __future__ import annotations

from cohaptic_server.mesh.search.point_tree import PointTree
from cohaptic_server.mesh.search.window_vertices import WindowVertices
from cohaptic_server.numeric import Ints
from cohaptic_server.world.loops.rows import (
    WindowLimits,
    WindowRequests,
    WindowRows,
    check_rows,
    same,
)

_PLANE, _MESH = 1, 3  # values of `cohaptic.protocol.patch.Geometry`


# Above 60 lines: one case after the other of one window, with the docs of nine arguments.
def choose_windows(
    surface: PointTree,
    found: Ints,
    finder: WindowVertices | None,
    first: int,
    asked: WindowRequests,
    limits: WindowLimits,
    before: Ints,
    old: WindowRows,
    new: WindowRows,
) -> int:
    """Copy each window of the last tick that still suffices, and choose the others anew.

    Args:
        surface: Tree of the n vertices of the surface.
        found: Buffer in which the tree leaves the vertices of one window, shape (n,).
        finder: Finder of windows on the touch mesh; None if all patches are planes.
        first: Row of the user to begin with.
        asked: What the users need their windows for.
        limits: How far windows reach, and when they are chosen anew.
        before: Row of each user in the last tick, -1 for none, shape (u,).
        old: Windows of the last tick.
        new: Set to the windows of this tick.

    Returns:
        Row of the user at which the loop stopped: u at the end, or the row of a user whose window
        does not fit into the arrays.

    Raises:
        ValueError: An array has another type or shape.
    """
    same("rows before", before.shape[0], asked.n)
    same("new windows", new.n, asked.n)
    check_rows(before, old.n)
    for i in range(first, asked.n):
        row = before[i]
        a, c, e = new.starts[0, i], new.starts[1, i], new.starts[2, i]
        if (
            row >= 0
            and old.geometry[row] == asked.geometry[i]
            and covers(old, row, asked, i, limits)
        ):
            if not copied(old, row, new, i):
                return i
            for k in range(7):
                new.keys[i, k] = old.keys[row, k]
            continue
        fits = carries = 0
        foot = asked.frames[i, 0]
        if asked.geometry[i] == _PLANE or finder is None:
            count = surface.within(foot[0], foot[1], foot[2], limits.radius, found)
            surface.sort(found, count)
        else:
            finder.choose(
                foot, asked.frames[i, 2], limits.radius, limits.reach, asked.directions[i],
                asked.lengths[i], limits.step, asked.half_widths[i],
                limits.limit if asked.geometry[i] == _MESH else 0,
            )  # fmt: skip
            count, fits, carries = finder.count, finder.fits, finder.carries
        # Checking one array is enough: no part of a window has more vertices than the whole.
        if a + count > new.vertices.shape[0]:
            return i
        if asked.geometry[i] == _PLANE or finder is None:
            for k in range(count):
                new.vertices[a + k] = found[k]
        else:
            for k in range(count):
                new.vertices[a + k] = finder.vertices[k]
            for k in range(fits):
                new.fitted[c + k] = finder.fitted[k]
            for k in range(carries):
                new.touched[e + k] = finder.touched[k]
                new.carried[e + k] = a + finder.carried[k]
        new.starts[0, i + 1] = a + count
        new.starts[1, i + 1] = c + fits
        new.starts[2, i + 1] = e + carries
        for k in range(3):
            new.keys[i, k] = foot[k]
            new.keys[i, 3 + k] = asked.slides[i, k]
        new.keys[i, 6] = asked.horizons[i]
    return asked.n


def covers(old: WindowRows, row: int, asked: WindowRequests, i: int, limits: WindowLimits) -> bool:
    """Return whether the window in row `row` of the last tick still suffices for contact `i`."""
    reuse = limits.reuse
    if not limits.speeding_up * abs(asked.horizons[i] - old.keys[row, 6]) <= reuse:
        return False
    for k in range(3):
        moved = asked.frames[i, 0, k] - old.keys[row, k]
        turned = asked.slides[i, k] - old.keys[row, 3 + k]
        if not (abs(moved) <= reuse and abs(turned) <= reuse):
            return False
    return True


def copied(old: WindowRows, row: int, new: WindowRows, i: int) -> bool:
    """Copy the window in row `row` of the last tick; return False if the arrays are too short."""
    for part in range(3):
        size = old.starts[part, row + 1] - old.starts[part, row]
        if new.starts[part, i] + size > new.vertices.shape[0]:
            return False
        new.starts[part, i + 1] = new.starts[part, i] + size
    a, b = new.starts[0, i], old.starts[0, row]
    shift = a - b
    for k in range(new.starts[0, i + 1] - a):
        new.vertices[a + k] = old.vertices[b + k]
    a, b = new.starts[1, i], old.starts[1, row]
    for k in range(new.starts[1, i + 1] - a):
        new.fitted[a + k] = old.fitted[b + k]
    a, b = new.starts[2, i], old.starts[2, row]
    for k in range(new.starts[2, i + 1] - a):
        new.touched[a + k] = old.touched[b + k]
        new.carried[a + k] = old.carried[b + k] + shift
    return True
