"""Pure conversion of a force to what the hand feels: resistance of the trigger, and rumble.

A trigger can resist but cannot push. Its resistance represents the part of the force against the
pull, and the rumble represents changes of the force. The hand does not feel a force along the pull,
or a sideways force that does not change.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from cohaptic.vec import ZERO, Vec3, dot, lerp, norm, sub
from cohaptic_drivers.dualsense.reports import LARGEST, OFF, Effects

# s; changes of the force that are faster than this become rumble, slower ones do not.
_MEMORY = 0.02
# A change by this fraction of `full` runs the motors fully. ASSUMPTION: no person has tried it.
_LOUD = 0.25
_QUIET = 0.08  # of full rumble; a weaker rumble is set to zero, as the motors would not turn
# N; forces below it are no contact. The law's own rounding is far smaller, a fingertip's
# threshold somewhat larger.
CONTACT = 0.02
_MAX_FORCE = 1e3  # N; larger than any force that the safety layer lets pass


@dataclass(frozen=True, slots=True)
class Feeling:
    """Effects for the last force, and the memory that the next conversion needs.

    Args:
        slow: The force, averaged over `_MEMORY` [N].
        start: Smallest pull of the trigger since the contact began, 0 to 255; None without contact.
        now: Time of the last force [s]; None before the first.
        effects: Effects for the pad.
    """

    slow: Vec3 = ZERO
    start: int | None = None
    now: float | None = None
    effects: Effects = OFF


NOTHING_FELT = Feeling()


def felt(
    before: Feeling, force: Vec3, *, pull: int, inward: Vec3, full: float, now: float
) -> Feeling:
    """Convert a force to effects of the pad; return them with the new memory.

    Args:
        before: Result for the last force.
        force: Force on the hand [N]; an impossibly large force or NaN counts as zero.
        pull: Pull of the trigger that corresponds to the tip's press, 0 to 255.
        inward: Direction in which a pull moves the tip; a unit vector.
        full: Force that the largest resistance stands for [N].
        now: Time of this force [s].
    """
    if not norm(force) < _MAX_FORCE:  # NaN too, which would stay in the memory for ever
        force = ZERO
    against = -dot(force, inward)
    start = None
    if against > CONTACT:
        start = pull if before.start is None else min(before.start, pull)
    resistance = 0 if start is None else max(1, min(LARGEST, round(LARGEST * against / full)))
    passed = 0.0 if before.now is None else max(0.0, now - before.now)
    slow = lerp(before.slow, force, 1.0 - math.exp(-passed / _MEMORY))
    loud = min(1.0, norm(sub(force, slow)) / (_LOUD * full))
    rumble = round(LARGEST * loud) if loud > _QUIET else 0
    return Feeling(slow, start, now, Effects(start or 0, resistance, rumble))
