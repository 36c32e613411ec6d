"""Whether a force comes to rest, still creeps to its value, or swings.

Three things that a table must not mix: a loop that swings without dying is *unstable*, and no
waiting helps; one whose force still moves to where it belongs is *slow*, and waiting does help; a
hand whose device is softer than the object feels less, at rest (`TouchStatus.soft`).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from enum import Enum

import numpy as np

from cohaptic_server.numeric import Floats

RIPPLE = 0.02  # N peak to peak in a force at rest, a step that no fingertip can tell; or
RIPPLE_SHARE = 0.01  # this share of it, whichever is more
DYING = 0.9  # of the swing before, at most, in a force whose swings die out
AT_LIMIT = 0.999  # of what the device gives


class Rest(Enum):
    """What became of a force."""

    RESTS = "rests"
    SLOW = "slow"
    UNSTABLE = "unstable"


def judge(
    force: Floats, stretches: Sequence[slice], measured: Callable[[slice], slice], limit: float
) -> list[Rest | None]:
    """What became of each hand's force; None where there is nothing to judge from.

    In the measured part of every stretch a force at rest keeps within `RIPPLE` or `RIPPLE_SHARE`
    of itself from its lowest to its highest value, slow drift counted. One that does not is slow
    if it goes one way, or to and fro by less and less. Else, and if it grows, it is unstable. So
    is one that has reached the limit of its device, as a loop does that swings in full. The worst
    stretch counts.

    Args:
        force: Of each hand, shape (users, n) [N].
        stretches: In which nobody intends to move.
        measured: The part of a stretch in which a force has to be at rest.
        limit: Of the device [N].
    """
    return [_worst(row, stretches, measured, limit) for row in force]


def _worst(
    force: Floats, stretches: Sequence[slice], measured: Callable[[slice], slice], limit: float
) -> Rest | None:
    if not stretches:
        return None
    if force.max() >= AT_LIMIT * limit:
        return Rest.UNSTABLE
    found = {judge_stretch(force[s], force[measured(s)]) for s in stretches}
    for rest in (Rest.UNSTABLE, Rest.SLOW):
        if rest in found:
            return rest
    return Rest.RESTS


def judge_stretch(force: Floats, end: Floats) -> Rest:
    """What became of one force in a stretch in which nobody intends to move.

    Args:
        force: In the stretch, shape (n,) [N].
        end: In its measured part [N].
    """
    allowed = max(RIPPLE, RIPPLE_SHARE * abs(float(end.mean())))
    if np.ptp(end) <= allowed:
        return Rest.RESTS
    # The first half is for what a press leaves behind.
    sizes = swings(force[len(force) // 2 :], allowed)
    return Rest.SLOW if len(sizes) < 2 or dies_out(sizes) else Rest.UNSTABLE


def swings(force: Floats, least: float) -> list[float]:
    """Sizes of the ways up and down of a force, one after the other; ways below `least` count not.

    Args:
        force: Shape (n,) [N].
        least: A turn by less is none [N].
    """
    turns: list[float] = []
    low = high = float(force[0])
    way = 0  # 1 up, -1 down, 0 not known yet
    for f in force.tolist():
        low, high = min(low, f), max(high, f)
        if way >= 0 and high - f > least:
            turns.append(high)
            way, low, high = -1, f, f
        elif way <= 0 and f - low > least:
            turns.append(low)
            way, low, high = 1, f, f
    turns += [high if way > 0 else low] if way else []
    sizes: list[float] = np.abs(np.diff(turns)).tolist()
    return sizes


def dies_out(sizes: Sequence[float]) -> bool:
    """Whether two swings or more become smaller: each `DYING` times the one before, or less.

    From the largest on, which may itself be what a press left behind, where enough come after it.
    The last may not be over: what it has come to by now is the least that it will be.
    """
    *whole, last = sizes
    if last > DYING * whole[-1]:
        return False
    if len(whole) == 1:
        return last < 0.5 * whole[0]
    largest = int(np.argmax(whole))
    after = whole[largest + 1 :] if len(whole) - largest > 2 else whole[largest:]
    if len(after) < 2:
        return False
    slope = np.polyfit(np.arange(len(after)), np.log(after), 1)[0]
    return bool(np.exp(slope) <= DYING)
