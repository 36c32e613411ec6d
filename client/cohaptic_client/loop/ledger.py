"""The ledger of a period: what each rule did to the force on the hand, in the order of the rules.

A force begins as that of the shown surface, and each rule adds to it or takes from it; the entries
together, with those of rules of other packages (`Period.added`), are the force that the hand was
given. A period holds all that the ledger is made from, so
that it costs nothing where nobody asks.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from cohaptic.vec import dot, norm
from cohaptic_client.loop.period import Period


class Ledger(NamedTuple):
    """Entries of one period [N]; those that hold a force back are negative.

    Fields:
        surface: Force of the law's spring on the surface of the patches, with the gain of the
            object there.
        models: What models of the other hands add to it, at once.
        gain: What the gain in use adds, which follows that of the object slowly.
        depth: What is held back, or still shown, of a surface that moves faster than the budget.
        law: What the law adds to its spring: its integral, the dent of its own force, and the
            law before it during a change.
        damping: What the passivity layer adds.
        friction: What friction adds to the size of the force, along the surface and as it moves
            the contact in or out.
        limit: What the largest force of the hand takes away.
        fade: What a fade of the safety layer takes away.
        rate: What is still to come, or to go, since the force changes no faster than its limit.
    """

    surface: float = 0.0
    models: float = 0.0
    gain: float = 0.0
    depth: float = 0.0
    law: float = 0.0
    damping: float = 0.0
    friction: float = 0.0
    limit: float = 0.0
    fade: float = 0.0
    rate: float = 0.0


def ledger_of(period: Period, max_force: float) -> Ledger:
    """Return the ledger of a period that has been computed.

    Args:
        max_force: Largest force on the hand [N].
    """
    given, scale = norm(period.force), period.safety.scale
    sight, fade = period.sight, period.fade
    if sight is None or fade is None:  # at most what is left of a force that is taken away
        return Ledger(rate=given)
    k_h, wanted = fade.now.gains.k_h, period.k_wanted
    shown, depth, pressed = (
        max(0.0, sight.depth),
        max(0.0, period.depth),
        max(0.0, period.law_depth),
    )
    free, answered = shown, period.answered
    if answered is not None:
        free = max(0.0, sight.depth - answered.shift)
    normal_force, size = period.local.normal_force, period.damped_force
    friction = k_h * (pressed - depth)
    if period.compliance is not None or period.added_size != 0.0:
        whole = norm(period.asked)
        friction += whole - period.added_size - size
        size = whole
    limit = min(size, max_force)
    return Ledger(
        surface=wanted * free,
        models=wanted * (shown - free),
        gain=(k_h - wanted) * shown,
        depth=k_h * (depth - shown),
        law=period.law_normal - k_h * pressed,
        damping=period.damped_force - normal_force,
        friction=friction,
        limit=limit - size,
        fade=(scale - 1.0) * limit,
        rate=given - scale * limit,
    )


def held_turn(period: Period) -> float:
    """Return what is held back of a turn of the force, at a right angle to it [N]."""
    sight, state = period.sight, period.state
    if sight is None or sight.depth <= 0.0 or state.normal_force <= 0.0:
        return 0.0
    if period.normal == sight.normal:
        return 0.0
    force = min(state.normal_force, period.settings.limits.max_force)
    return force * math.acos(max(-1.0, min(1.0, dot(period.normal, sight.normal))))
