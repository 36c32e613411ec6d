"""Small loops over the vectors of all users; numpy would need several calls for each."""

from __future__ import annotations

import math

from cohaptic_server.numeric import Floats, Ints


def heights(frames: Floats, tips: Floats, places: Floats, found: Floats) -> None:
    """Compute the height of each tip over a point of its contact, along the contact's normal.

    Args:
        frames: Frames of the contacts, shape (n, 3, 3).
        tips: Positions of the tips, shape (n, 3) [m].
        places: One point of each contact, shape (n, 3) [m].
        found: Set to the heights, shape (n,) [m].
    """
    for i in range(frames.shape[0]):
        height = 0.0
        for axis in range(3):
            height += frames[i, 2, axis] * (tips[i, axis] - places[i, axis])
        found[i] = height


def pressed(frames: Floats, forces: Floats, limit: Floats, found: Floats) -> None:
    """Compute the normal part of each force on a hand, from 0 to the device's limit; 0 for NaN.

    Args:
        frames: Frames of the contacts, shape (n, 3, 3).
        forces: Forces on the hands, shape (n, 3) [N].
        limit: Largest force of each device, shape (n,) [N].
        found: Set to the normal forces, shape (n,) [N].
    """
    for i in range(frames.shape[0]):
        along = 0.0
        for axis in range(3):
            along += frames[i, 2, axis] * forces[i, axis]
        found[i] = 0.0
        if along > 0.0:
            found[i] = min(along, limit[i])


def tangential_parts(frames: Floats, vectors: Floats, found: Floats) -> None:
    """Compute the part of each vector in the tangent plane of its contact.

    Args:
        frames: Frames of the contacts, shape (n, 3, 3).
        vectors: One vector for each contact, shape (n, 3).
        found: Set to the tangential parts, shape (n, 3).
    """
    for i in range(frames.shape[0]):
        along = 0.0
        for axis in range(3):
            along += frames[i, 2, axis] * vectors[i, axis]
        for axis in range(3):
            found[i, axis] = vectors[i, axis] - along * frames[i, 2, axis]


def smoothed(
    before: Ints,
    tips: Floats,
    old_tips: Floats,
    old: Floats,
    times: Floats,
    old_times: Floats,
    fresh: Floats,
    least: float,
    fraction: float,
    found: Floats,
) -> None:
    """Update the running mean of each tip's velocity.

    Args:
        before: Row of each user in the last tick; -1 for a user who was not there, whose velocity
            is then 0, shape (n,).
        tips: Positions of the tips now, shape (n, 3) [m].
        old_tips: Positions of the tips in the rows of the last tick, shape (m, 3) [m].
        old: Mean velocities in the rows of the last tick, shape (m, 3) [m/s].
        times: Times of the samples, shape (n,) [s].
        old_times: Times of the samples in the rows of the last tick, shape (m,) [s].
        fresh: 1 for users whose samples still arrive, else 0, shape (n,).
        least: Shortest interval between two samples that gives a velocity [s].
        fraction: Share of the newest velocity in the mean.
        found: Set to the mean velocities, shape (n, 3) [m/s].
    """
    for i in range(before.shape[0]):
        row = before[i]
        for axis in range(3):
            found[i, axis] = 0.0
        if row < 0:
            continue
        interval = times[i] - old_times[row]
        for axis in range(3):
            mean = old[row, axis]
            if interval >= least:
                newest = (tips[i, axis] - old_tips[row, axis]) / interval
                found[i, axis] = mean + fraction * (newest - mean)
            elif fresh[i] > 0.0:
                found[i, axis] = mean


def jumped(frames: Floats, before: Ints, old: Floats, limit: float, found: Ints) -> bool:
    """Find contacts that are new, or further from their last position than a hand can move them.

    Args:
        frames: Frames of the contacts, shape (n, 3, 3).
        before: Row of each user in the last tick; -1 for a user who was not there, shape (n,).
        old: Frames of the contacts in the rows of the last tick, shape (m, 3, 3).
        limit: Distance that a hand can move a contact in a tick [m].
        found: Set to each user's row in the last tick; -1 for a contact that is new or has moved
            too far, shape (n,).

    Returns:
        Whether any row in `found` is -1.
    """
    anybody = False
    for i in range(frames.shape[0]):
        row = before[i]
        found[i] = row
        if row >= 0:
            square = 0.0
            for axis in range(3):
                way = frames[i, 0, axis] - old[row, 0, axis]
                square += way * way
            # Not the opposite comparison: a distance that is NaN must count as a jump.
            if not math.sqrt(square) <= limit:
                found[i] = -1
        if found[i] < 0:
            anybody = True
    return anybody
