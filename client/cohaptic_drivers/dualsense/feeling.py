"""What a finger at the trigger feels of a force: resistance, and rumble of changes. Pure.

A trigger resists; it cannot push. It stands for the part of the force that is against the pull, and
nothing stands for the opposite, nor for a force sideways that does not change.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from cohaptic.vec import ZERO, Vec3, dot, lerp, norm, sub
from cohaptic_drivers.dualsense.reports import MOST, OFF, Effects

# s; what changes faster than this is rumble, what changes slower is not.
_MEMORY = 0.02
# A change by this share of the full force runs the motors fully. ASSUMPTION: nobody has felt it.
_LOUD = 0.25
_QUIET = 0.08  # share of full rumble below which there is none: motors that weak do not turn
# N; forces below it are no contact. The law's own rounding is far smaller, a fingertip's
# threshold somewhat larger.
CONTACT = 0.02
_MOST_FORCE = 1e3  # N; above all that the safety layer lets pass


@dataclass(frozen=True, slots=True)
class Feeling:
    """Memory of what is felt.

    Args:
        slow: The force, averaged over `_MEMORY` [N].
        start: Pull of the trigger at which the contact began, 0 to 255; None without one.
        now: Time of the last force [s]; None before the first.
        effects: For the pad.
    """

    slow: Vec3 = ZERO
    start: int | None = None
    now: float | None = None
    effects: Effects = OFF


NOTHING_FELT = Feeling()


def felt(
    before: Feeling, force: Vec3, *, pull: int, inward: Vec3, full: float, now: float
) -> Feeling:
    """What is felt of a force.

    Args:
        before: After the last one.
        force: On the hand [N]; one that cannot be counts as none.
        pull: Pull of the trigger at which the tip is where it is, 0 to 255.
        inward: Direction in which a pull moves the tip; a unit vector.
        full: Force that full resistance stands for [N].
        now: Time [s].
    """
    if not norm(force) < _MOST_FORCE:  # NaN too, which would stay in the memory for ever
        force = ZERO
    against = -dot(force, inward)
    start = None
    if against > CONTACT:
        start = pull if before.start is None else min(before.start, pull)
    resistance = 0 if start is None else max(1, min(MOST, round(MOST * against / full)))
    passed = 0.0 if before.now is None else max(0.0, now - before.now)
    slow = lerp(before.slow, force, 1.0 - math.exp(-passed / _MEMORY))
    loud = min(1.0, norm(sub(force, slow)) / (_LOUD * full))
    rumble = round(MOST * loud) if loud > _QUIET else 0
    return Feeling(slow, start, now, Effects(start or 0, resistance, rumble))
