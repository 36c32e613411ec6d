"""Slew limits for changes of the force that the hand's own motion does not cause.

`EXTERNAL_RATE` limits the sum of these changes. The depth, the direction, the gain and the
compliance of a contact each change the force by at most their part of that rate.
"""

from __future__ import annotations

import math
from typing import Final

from cohaptic.control.friction import Compliance3, FrictionState, least_eigenvalue, tangents
from cohaptic.vec import Vec3, add, dot, norm, scale, sub, unit
from cohaptic_client.loop.safety import EXTERNAL_RATE

# A gain changes by at most 1 % per millisecond, and the force with it at half of `EXTERNAL_RATE`:
# at 1 N both are the same. Reasoned, not measured.
GAIN_RATE: Final = 10.0  # 1/s
# N/m; a softer contact has too little force for a step (10 mN at 10 mm), and a gain of 0 would
# stay 0.
SOFT: Final = 1.0


def hold_back(depth: float, target: float, limit: float) -> float:
    """Limit the change of the depth by the surface's own motion; return the depth for the law [m].

    Args:
        depth: Depth of the last period plus the hand's displacement into the surface since then
            [m].
        target: Depth of the probe below the shown surface [m].
        limit: Largest displacement of the surface in this period [m].
    """
    if depth <= 0.0 and target <= 0.0:
        return target  # out of contact there is no force to change
    start = max(0.0, depth)  # contact force begins at depth 0
    return min(max(target, start - limit), start + limit)


def turn_back(normal: Vec3, target: Vec3, limit: float) -> tuple[Vec3, float]:
    """Turn the force direction from the last normal to the surface's normal, by at most `limit`.

    Args:
        normal: Unit normal of the last period.
        target: Unit normal of the shown surface.
        limit: Largest turn in this period [rad].

    Returns:
        Unit normal for this period, and its angle to `normal` [rad].
    """
    along = dot(normal, target)
    # Divided by the square too: a 32-bit normal is not an exact unit vector, and with an opposite
    # target the remainder along the normal would pass for a direction of the turn.
    aside = sub(target, scale(normal, along / dot(normal, normal)))
    size = norm(aside)
    angle = math.atan2(size, along)
    if angle <= limit:
        return target, angle
    # All rotations to the opposite direction are equally short: any tangent will do.
    way = scale(aside, 1.0 / size) if size > 1e-9 else tangents(normal)[0]
    return unit(add(scale(normal, math.cos(limit)), scale(way, math.sin(limit)))), limit


def slew_normal(
    normal: Vec3, target: Vec3, moved: Vec3, k_h: float, force: float, left: float
) -> tuple[Vec3, float]:
    """Turn the force direction towards the surface's normal within the budget of this period.

    The hand's own displacement along the surface may also turn the force, by as much as it changes
    the force, without using the budget. At least half of the budget remains for the magnitude of
    the force.

    Args:
        normal: Unit normal of the last period.
        target: Unit normal of the shown surface.
        moved: Displacement of the hand in this period [m].
        k_h: Gain in use [N/m].
        force: Magnitude of the force on the hand, above 0 [N].
        left: What is left of the budget [N].

    Returns:
        Unit normal for this period, and what the turn takes of the budget [N].
    """
    own = k_h * norm(sub(moved, scale(normal, dot(normal, moved))))
    normal, turn = turn_back(normal, target, (0.5 * left + own) / force)
    return normal, max(0.0, turn * force - own)


def slew_gain(k_h: float, target: float, dt: float, force: float = 0.0) -> float:
    """Move a gain towards its target by at most the factor exp(`GAIN_RATE` dt); return it [N/m].

    Args:
        k_h: Gain in the last period [N/m].
        target: Gain to be reached [N/m].
        dt: Time since the last period [s].
        force: Force that the gain makes now; the move changes this force by at most half of
            `EXTERNAL_RATE` [N].
    """
    if target == k_h:
        return k_h
    rate = min(GAIN_RATE, 0.5 * EXTERNAL_RATE / force) if force > 0.0 else GAIN_RATE
    factor = math.exp(min(1.0, rate * dt))
    return min(max(target, k_h / factor), max(k_h, SOFT) * factor)


def slew_compliance(
    previous: Compliance3 | None,
    newest: Compliance3 | None,
    friction: FrictionState,
    normal_force: float,
    fraction: float,
    limit: float,
) -> Compliance3 | None:
    """Move the friction's compliance matrix C towards that of the newest patch; return it [m/N].

    A patch without a compliance matrix leaves the previous one in use, so that a sticking contact
    holds.

    Args:
        previous: Compliance matrix of the last period [m/N]; None before the first.
        newest: Compliance matrix of the newest patch [m/N]; None if the patch has none.
        friction: State of the friction after the last period.
        normal_force: Normal force in the last period [N].
        fraction: Fraction of the difference that time alone would allow in this period, 0 to 1.
        limit: Largest change of the force that the move may cause in this period [N].
    """
    if newest is None or previous is None or previous == newest or not friction.touching:
        return newest or previous
    # f = C^-1 x, so a change dC of C changes f by at most |dC| |f| over the least eigenvalue of C.
    change = math.sqrt(sum((b - a) ** 2 for a, b in zip(previous, newest, strict=True)))
    force = math.hypot(normal_force, norm(friction.force))
    if force > 0.0:
        fraction = min(
            fraction, limit * least_eigenvalue(previous) / (math.sqrt(2.0) * change * force)
        )
    if fraction >= 1.0:
        return newest
    return Compliance3(*(a + fraction * (b - a) for a, b in zip(previous, newest, strict=True)))
