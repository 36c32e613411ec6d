"""Judges whether a force comes to rest, still approaches its value, or oscillates.

There are three cases with different remedies. A loop whose oscillation does not decay is
*unstable*, and waiting does not help. A loop whose force still approaches its value is *slow*, and
waiting helps. A hand whose device is softer than the object feels less force, but the force rests
(`TouchStatus.soft`).

A swing is one rise or fall of an oscillating force [N].
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from enum import Enum

import numpy as np

from cohaptic_server.numeric import Floats

# A force counts as at rest if it varies by no more than the larger of these, peak to peak.
RIPPLE = 0.02  # N; below the perception threshold of a fingertip
RIPPLE_FRACTION = 0.01  # fraction of the force
DYING = 0.9  # largest ratio of successive swings in a decaying oscillation
AT_LIMIT = 0.999  # fraction of the device's largest force


class Rest(Enum):
    """Verdict on a force: it rests, approaches its value slowly, or is unstable."""

    RESTS = "rests"
    SLOW = "slow"
    UNSTABLE = "unstable"


def judge(
    force: Floats,
    stretches: Sequence[slice],
    on_time: Sequence[slice | None],
    measured: Callable[[slice], slice],
) -> list[Rest | None]:
    """Return a verdict on each hand's force; None if there is no stretch to judge from.

    In the measured part of a stretch a force at rest varies by at most `RIPPLE` or
    `RIPPLE_FRACTION`
    of itself peak to peak, drift included. A force that varies more is slow if it changes
    monotonically or its oscillation decays, and unstable otherwise. The worst stretch counts.

    A stretch in which something came late shows a force at rest as well as any other, but accuses
    no force: what moves there may have been moved by the machine or the link.

    Args:
        force: Force on each hand, shape (users, n) [N].
        stretches: Intervals of time indices in which no hand intends to move.
        on_time: Part of each stretch in which patches and haptic periods came on time; None if it
            is too short to accuse a force.
        measured: Returns the part of a stretch in which a force must be at rest.
    """
    return [_judge_one(row, stretches, on_time, measured) for row in force]


def _judge_one(
    force: Floats,
    stretches: Sequence[slice],
    on_time: Sequence[slice | None],
    measured: Callable[[slice], slice],
) -> Rest | None:
    found: list[Rest] = []
    for stretch, part in zip(stretches, on_time, strict=True):
        verdict = judge_stretch(force[stretch], force[measured(stretch)])
        if verdict is not Rest.RESTS:
            if part is None:
                continue
            verdict = judge_stretch(force[part], force[measured(part)])
        found.append(verdict)
    return worst(found)


def reaches_limit(
    force: Floats, on_time: Sequence[slice | None], limit: float, *, always: bool
) -> bool:
    """Return whether a force reaches the limit of its device, as growing oscillations do.

    Args:
        force: Force on one hand, shape (n,) [N].
        on_time: Intervals of time indices in which everything came on time.
        limit: Largest force of the device [N].
        always: Whether everything came on time in the whole recording; then forces of moving hands
            count as well.
    """
    reached = force >= AT_LIMIT * limit
    return bool(any(part and reached[part].any() for part in on_time) or (always and reached.any()))


def worst(verdicts: Iterable[Rest | None]) -> Rest | None:
    """Return the worst of several verdicts on one force; None if there is none."""
    found = set(verdicts)
    return next((r for r in (Rest.UNSTABLE, Rest.SLOW, Rest.RESTS) if r in found), None)


def judge_stretch(force: Floats, end: Floats) -> Rest:
    """Return a verdict on one force in a stretch, in which no hand intends to move.

    Args:
        force: Force in the stretch, shape (n,) [N].
        end: Force in the measured part of the stretch, shape (m,) [N].
    """
    allowed = max(RIPPLE, RIPPLE_FRACTION * abs(float(end.mean())))
    if np.ptp(end) <= allowed:
        return Rest.RESTS
    # The first half is left out: it contains the transient of the press.
    sizes = swings(force[len(force) // 2 :], allowed)
    return Rest.SLOW if len(sizes) < 2 or dies_out(sizes) else Rest.UNSTABLE


def swings(force: Floats, least: float) -> list[float]:
    """Return the heights of the successive rises and falls of a force [N].

    Args:
        force: Force over time, shape (n,) [N].
        least: Height below which a rise or fall is ignored [N].
    """
    turns: list[float] = []
    low = high = float(force[0])
    direction = 0  # 1 up, -1 down, 0 not known yet
    for f in force.tolist():
        low, high = min(low, f), max(high, f)
        if direction >= 0 and high - f > least:
            turns.append(high)
            direction, low, high = -1, f, f
        elif direction <= 0 and f - low > least:
            turns.append(low)
            direction, low, high = 1, f, f
    turns += [high if direction > 0 else low] if direction else []
    sizes: list[float] = np.abs(np.diff(turns)).tolist()
    return sizes


def dies_out(sizes: Sequence[float]) -> bool:
    """Whether an oscillation decays, on average to at most `DYING` from swing to swing.

    The decay is fitted after the largest swing, which may be the transient of a press, if enough
    swings follow it. The last swing may be incomplete: its height so far is a lower bound. Of only
    two swings the second must be below half of the first.

    Args:
        sizes: Heights of the swings in order, two or more [N].
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
