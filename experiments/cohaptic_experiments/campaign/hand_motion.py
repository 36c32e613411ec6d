"""Intended motion of the compiled room's hands: press, tremor, slide, release, second press."""

from __future__ import annotations

import math

from cohaptic_experiments.campaign.compiled import compiled
from cohaptic_server.numeric import Floats

PRESS_TIME = 0.3  # s, from in front of the surface to the full depth
CLEARANCE = 0.01  # m in front of the surface before the press


@compiled
def intended(hand: Floats, motion: Floats, now: float) -> tuple[float, float]:
    """Intended position of a tip: height over the resting surface, and sideways [m].

    Args:
        hand: One row of `kernel.haptics`' argument of that name.
        motion: One row, likewise.
        now: Time since the trial began [s].
    """
    s = min(1.0, max(0.0, (now - hand[4]) / PRESS_TIME))
    pressed = s * s * (3.0 - 2.0 * s)
    off = min(1.0, max(0.0, (now - motion[6]) / PRESS_TIME))
    back = min(1.0, max(0.0, (now - motion[7]) / PRESS_TIME))
    pressed *= 1.0 - off * off * (3.0 - 2.0 * off) + back * back * (3.0 - 2.0 * back)
    depth = -CLEARANCE + (hand[3] + CLEARANCE) * pressed
    # The motion fades out over its last second, so that a quiet hand is not one that was stopped.
    calm = min(1.0, max(0.0, motion[8] - now))
    depth += calm * motion[0] * math.sin(6.283185307179586 * motion[1] * now + motion[2])
    depth += calm * motion[3] * math.sin(6.283185307179586 * motion[4] * now)
    side = motion[5] * math.sin(6.283185307179586 * motion[4] * now + motion[2])
    return -depth, calm * side * pressed
