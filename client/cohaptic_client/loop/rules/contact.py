"""Rules on the contact: its gain, its compliance, its direction and its depth.

Over one simulation period the gain K_h moves from its value at the arrival of a patch to the value
for that patch at the probe. Each rule changes the force no faster than its part of the budget
allows, except for changes that the hand's own motion causes.
"""

from __future__ import annotations

import math

from cohaptic.control.friction import believed_shift, normal_shift, wedging
from cohaptic.control.geometry import Sight
from cohaptic.control.laws.model import Gains
from cohaptic.vec import dot, norm
from cohaptic_client.loop.gains import gains_under
from cohaptic_client.loop.law_fade import LAW_FADE_RATE, stiffest, with_gains
from cohaptic_client.loop.passivity import RAMP, SLOW
from cohaptic_client.loop.period import Period
from cohaptic_client.loop.rule import Rule
from cohaptic_client.loop.safety import EXTERNAL_RATE
from cohaptic_client.loop.slew import SOFT, hold_back, slew_compliance, slew_gain, slew_normal


class Gain(Rule):
    """Moves the gain towards that of the object at the probe."""

    def apply(self, period: Period) -> None:
        """Replace `fade`, and fill in `k_h`."""
        state, fade, sight, settings = period.state, period.fade, period.sight, period.settings
        patch = state.patch
        if sight is None or fade is None or patch is None:
            return
        k_h = wanted = fade.now.gains.k_h
        if patch.law is fade.now.law:
            newest = gains_under(patch, sight, settings)
            wanted = state.k_h_before + period.fraction * (newest.k_h - state.k_h_before)
            after = slew_gain(k_h, wanted, period.counted, state.normal_force)
            change = abs(after - k_h) * max(0.0, state.depth)
            period.spent_gain = period.budget.take(change)
            if period.spent_gain < change:
                after = k_h + (after - k_h) * period.spent_gain / change
            same = after == newest.k_h
            fade = period.fade = with_gains(
                fade, newest if same else Gains(after, newest.integral_gain)
            )
        period.k_h = stiffest(fade)
        period.k_wanted = wanted


class Reserve(Rule):
    """Reserves what fades, and the damping of a slow hand, may change of the force."""

    def apply(self, period: Period) -> None:
        """Fill in `fade_limit`, `law_fade_limit` and `damping_limit`."""
        fade, budget, memory = period.fade, period.budget, period.state.passivity
        if fade is None:
            return
        if period.silent or period.state.safety.scale < 1.0:
            period.fade_limit = budget.take(period.fade_limit)
            period.spent_fades += period.fade_limit
        if fade.before is not None:
            period.law_fade_limit = budget.take(LAW_FADE_RATE * period.counted)
            period.spent_fades += period.law_fade_limit
        # The motion of a slow hand explains no change of its damping (`own_force`).
        speed = norm(period.sample.velocity)
        if 0.0 < speed <= SLOW and (memory.owed > 0.0 or memory.damping > 0.0):
            whole = speed * period.settings.max_damping * period.counted / RAMP
            granted = budget.take(whole)
            period.spent_fades += granted
            if granted < whole:
                period.damping_limit = granted / speed


class Compliance(Rule):
    """Moves the compliance of a contact with friction, and sets the friction's half aside."""

    def apply(self, period: Period) -> None:
        """Fill in `compliance`."""
        state, settings = period.state, period.settings
        patch = state.patch
        if period.sight is None or patch is None or settings.friction <= 0.0:
            return
        fraction = period.counted / settings.simulation_period
        half = period.budget.reserve(0.5)  # for the friction and its compliance
        C = period.compliance = slew_compliance(
            state.compliance,
            patch.compliance,
            state.friction,
            state.normal_force,
            fraction,
            0.5 * half,
        )
        if C is not None:
            # Friction amplifies a change of the normal force: leave a part of the budget for that.
            period.budget.reserve(wedging(settings.friction, state.normal, C, period.k_h))


class Turn(Rule):
    """Turns the force towards the surface's normal."""

    def apply(self, period: Period) -> None:
        """Fill in `normal` and `moved_in`, and set the friction's part of the budget aside."""
        sight, state, budget = period.sight, period.state, period.budget
        if sight is None:
            return
        normal = sight.normal
        if state.normal_force > 0.0 and normal != state.normal:
            # Where the contact ends, a vanishing force need not turn any more.
            normal = state.normal
            if sight.depth > 0.0:
                force = min(state.normal_force, period.settings.limits.max_force)
                normal, turned = slew_normal(
                    state.normal, sight.normal, period.moved, period.k_h, force, budget.left
                )
                period.spent_turn = budget.take(turned)
        period.normal = normal
        period.moved_in = -dot(normal, period.moved)
        period.for_friction = 0.5 * budget.left


class Depth(Rule):
    """Moves the depth with the hand, with the models, and with the surface as the budget allows."""

    def apply(self, period: Period) -> None:
        """Fill in `depth` and `limit`."""
        sight, state, k_h = period.sight, period.state, period.k_h
        if sight is None:
            return
        # A force that the hand does not get may change at once.
        given = state.sight is not None and state.safety.scale > 0.0
        own = state.depth + period.moved_in
        if period.model_change != 0.0 or period.wished != 0.0:
            change, wished = sight.depth - state.depth, period.wished
            by_models, beyond = _by_models(change, period.moved_in, period.model_change, wished)
            period.spent_models = period.budget.take(beyond * k_h)
            if period.spent_models < beyond * k_h:  # the rest of what others want has to wait
                wished -= math.copysign(beyond - period.spent_models / k_h, wished)
                by_models, _ = _by_models(change, period.moved_in, period.model_change, wished)
            own += by_models
        limit = period.budget.left if given else math.inf
        period.depth = hold_back(own, sight.depth, limit / max(k_h, SOFT))
        if given:
            way = max(0.0, period.depth) - max(0.0, own)
            period.spent_depth = period.budget.take(abs(way) * k_h)
        # An experiment that has no such limit behind the law has none for its integral, either.
        external = period.settings.limits.external_rate
        period.max_change = limit + max(0.0, external - EXTERNAL_RATE) * period.counted


def _by_models(
    change: float, moved_in: float, model_change: float, wished: float
) -> tuple[float, float]:
    """Return the change of the depth by models, and the part of it that uses the budget [m].

    Models may bring the depth to that below the shown surface, and not beyond it.

    Args:
        change: Depth below the shown surface, less the depth in the last period [m].
        moved_in: Displacement of the hand into the surface [m].
        model_change: Change by the models' answer [m].
        wished: Change by what others want [m].
    """
    own, gap = moved_in + model_change, change - moved_in
    whole = own + wished
    beyond = max(0.0, whole - max(0.0, own), min(0.0, own) - whole)
    return max(min(0.0, gap), min(max(0.0, gap), model_change + wished)), beyond


def held(period: Period, sight: Sight) -> Sight:
    """Return the surface for the law: at `depth`, less the friction's shift of the contact."""
    depth, C = period.depth, period.compliance
    if C is not None:
        normal = period.normal
        depth -= believed_shift(normal, C, period.k_h) * normal_shift(
            period.state.friction, normal, C
        )
    if depth == sight.depth:
        return sight
    return Sight(depth, sight.normal, sight.c_ii, sight.own_force, sight.u_others)
