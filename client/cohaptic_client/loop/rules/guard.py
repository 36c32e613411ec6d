"""The guard: the four last rules on the force, for any law, network or device.

A fault takes the force away. Otherwise the force is clamped, fades where it must, and changes no
faster than its limit. A change that the hand's own motion does not explain is held to
`EXTERNAL_RATE`, whatever force a law computes from a patch. A motion explains a change of the force
in its own period only; a change that `max_rate` has held back is remembered for about `FORGET_OWN`.
After a loop has stood still, what the hand did meanwhile changes the force as slowly as the hand
did it.
"""

from __future__ import annotations

import math
from typing import Final

from cohaptic.status.reason import LET_GO
from cohaptic.vec import norm, scale, sub
from cohaptic_client.loop.law_fade import stiffest
from cohaptic_client.loop.passivity import SLOW
from cohaptic_client.loop.period import Period
from cohaptic_client.loop.rule import Rule
from cohaptic_client.loop.safety import (
    BACKSTOP,
    FORGET_OWN,
    NO_TROUBLE,
    NOT_HELD,
    STOOD_STILL,
    Mode,
    SafetyState,
    Trouble,
    clamped,
    find_fault,
    next_fraction,
    released,
    towards,
)

# Share of the law's force; a larger damping force counts as cut to that force. Just below the cut,
# so that a force near it counts, whatever the rounding. Reasoned, not measured.
_CUT: Final = 0.95
SWITCH: Final = 1  # bit of `DeviceSample.buttons`
_DROPPED: Final = Trouble(LET_GO, NOT_HELD)
# Bound once: to look a member up in its class takes a tenth of a microsecond, every period.
_WAITING: Final = Mode.WAITING
_ENGAGED: Final = Mode.ENGAGED
_FAULT: Final = Mode.FAULT


class Fault(Rule):
    """Takes the force away on a smooth ramp, after which the hand has to be engaged again."""

    def apply(self, period: Period) -> None:
        """Fill in `safety` and `force` where the hand is let go, and `let_go`."""
        state, limits, sample = period.state.safety, period.settings.limits, period.sample
        dropped = limits.dead_man and sample.buttons & SWITCH == 0
        fault = NO_TROUBLE
        if not dropped:  # a device that nobody holds may fall at any speed
            fault = period.trouble
            if not fault.cause:
                fault = find_fault(period.asked, sample.velocity, period.dt, limits)
        if not (fault.cause or dropped or state.left > 0.0):
            return
        latched = state.mode is _FAULT or (limits.latch and fault.cause != 0)
        if dropped and not latched:
            fault = _DROPPED
        period.let_go = True
        period.safety = released(state, fault, period.counted, period.now, latched)
        given(period)


class Limit(Rule):
    """Clamps the force, before it fades: a force beyond the limit must not hold up a fade."""

    def apply(self, period: Period) -> None:
        """Fill in `force`."""
        if not period.let_go:
            period.force = clamped(period.asked, period.settings.limits.max_force)


class Fade(Rule):
    """Gives no force until the hand is outside, and fades it while the server is silent."""

    def apply(self, period: Period) -> None:
        """Fill in `engaged`, `quiet` and `scale`, and replace `force`."""
        if period.let_go:
            return
        state, limits = period.state.safety, period.settings.limits
        size = norm(period.asked)
        # Without a surface, as after a law has failed, nobody is engaged: the fault stays told.
        no_surface = period.sight is None
        pressing = math.inf if no_surface and period.state.patch is not None else size
        if period.sight is not None:  # a soft law, or a rule that takes force, engages no hand
            pressing = max(pressing, period.sight.depth / period.sight.c_ii)
        silent = period.silent or no_surface
        period.quiet = state.quiet + 1 if pressing < limits.engage_below else 0
        period.engaged = state.mode is _ENGAGED or (
            state.mode is _WAITING and period.quiet >= limits.engage_periods and not silent
        )
        up = period.engaged and not silent
        period.scale = next_fraction(
            state.scale, up, min(size, limits.max_force),
            limits.engage_time if up else limits.fade_time, period.counted, period.fade_limit,
        )  # fmt: skip
        if period.scale < 1.0:
            period.force = scale(period.force, period.scale)


class Rate(Rule):
    """Limits the change of the force: a force that vanishes jolts the hand, too."""

    def apply(self, period: Period) -> None:
        """Fill in `safety`, and replace `force`."""
        if period.let_go:
            return
        state, settings, step = period.state.safety, period.settings, period.counted
        limits, velocity = settings.limits, period.sample.velocity
        own = own_force(period) + period.state.k_h * abs(period.model_change)
        damping = max(period.damping, period.state.passivity.damping)
        damping = max(damping, min(damping + period.added_damping, settings.max_damping))
        if damping > 0.0 and velocity != state.velocity:
            own += damping * norm(sub(velocity, state.velocity))
        own = min(own, 2.0 * limits.max_force)
        catch_up, at_once = state.catch_up, own
        if period.dt > STOOD_STILL:
            catch_up, at_once = max(catch_up, own / period.dt), 0.0
        if catch_up > 0.0:
            own += state.own
            at_once += min(own - at_once, catch_up * step)
        else:
            own += state.own * (1.0 - step / FORGET_OWN)
            at_once = own
        own = min(own, 2.0 * limits.max_force)
        limit = min(limits.max_rate * step, at_once + BACKSTOP * limits.external_rate * step)
        wanted = period.force
        force = period.force = towards(state.force, wanted, limit)
        held_back = own - limit if own > limit else 0.0
        if held_back > 0.0:  # no more than is still to come
            held_back = min(held_back, norm(sub(wanted, force)))
        mode, words, cause = state.mode, state.fault, state.cause
        if period.engaged:
            mode, words, cause = _ENGAGED, "", 0
        period.safety = SafetyState(
            mode, period.scale, force, period.quiet, period.now, words, own=held_back,
            velocity=velocity, catch_up=catch_up if held_back > 0.0 else 0.0, cause=cause,
        )  # fmt: skip
        given(period)


def given(period: Period) -> None:
    """Fill in `force` from the guard's memory, and `given_ratio`."""
    safety, size = period.safety, period.damped_force
    period.force = safety.force
    if period.compliance is not None or period.added_size != 0.0:
        size = norm(period.asked)
    period.given_ratio = norm(safety.force) / size if size > 0.0 else safety.scale


def own_force(period: Period) -> float:
    """Return the largest change of the force in a period that the hand's own motion explains [N].

    The contact's spring changes the force by the hand's displacement times the stiffness in the
    stiffest direction, into or along the surface. Friction adds mu times as much, at a right angle
    to the normal force. For a hand faster than `SLOW` the damping counts, too: the change may
    double while the damping force is cut to the law's force, and the damping may rise or fall. For
    a slower hand the damping does not count: such a hand has little energy to be taken out, and
    would feel little but the changes that a server causes.
    """
    way, state, settings = norm(period.moved), period.state, period.settings
    if way == 0.0:
        return 0.0
    stiffness = state.fade.now.gains.k_h if state.fade is not None else 0.0
    if period.fade is not None:
        along = min(period.friction.stiffness, settings.max_stiffness)
        stiffness = max(stiffness, stiffest(period.fade), along)
    if period.added_stiffness > 0.0:
        both = stiffness + period.added_stiffness
        stiffness = max(stiffness, min(both, settings.max_stiffness))
    own = math.hypot(1.0, settings.friction) * stiffness * way
    law_force = period.local.normal_force
    if period.damping > 0.0 and law_force > 0.0:
        speed = norm(period.sample.velocity)
        if speed > SLOW:
            if abs(period.damped_force - law_force) >= _CUT * law_force:
                own *= 2.0
            own += speed * abs(period.damping - state.passivity.damping)
    return own
