"""Rules on what the hand and the body get, and the accounts that are kept of it."""

from __future__ import annotations

import math
from typing import Final

from cohaptic.control.friction import Compliance3, FrictionState, times
from cohaptic.control.geometry import Sight
from cohaptic.control.law import pressed_depth
from cohaptic.vec import ZERO, Vec3, add, dot, norm, scale, sub
from cohaptic_client.loop.law_fade import LawFade, stiffest
from cohaptic_client.loop.passivity import SLOW, Passivity, given_share, observe
from cohaptic_client.loop.period import Period
from cohaptic_client.loop.replica import move
from cohaptic_client.loop.rule import Rule
from cohaptic_client.loop.safety import guard
from cohaptic_client.loop.trust import trusted

_CUT: Final = 0.95  # share of the law's force; a larger damping force counts as cut to that force
SWITCH: Final = 1  # bit of `DeviceSample.buttons`


class Limits(Rule):
    """Limits the force for the device: largest force, fades, rate, and faults."""

    def apply(self, period: Period) -> None:
        """Fill in `safety`, `force` and `given_ratio`."""
        state, sample = period.state, period.sample
        damping = max(period.damping, state.passivity.damping)
        # Without a surface, as after a law has failed, nobody is engaged: the fault stays told.
        pressing = math.inf if period.sight is None and state.patch is not None else 0.0
        if period.added:  # what a rule takes of the force does not engage a hand
            pressing = max(pressing, period.law_normal)
        safety = period.safety = guard(
            state.safety, period.asked, now=period.now, velocity=sample.velocity,
            silent=period.silent or period.sight is None, limits=period.settings.limits,
            trouble=period.trouble,
            held=sample.buttons & SWITCH != 0,
            own=own_force(period) + state.k_h * abs(period.explained),
            damping=max(damping, min(damping + period.added_damping, period.settings.max_damping)),
            pressing=pressing,
            fade_most=period.fade_most,
        )  # fmt: skip
        period.force = safety.force
        size = period.damped_force
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


class Account(Rule):
    """Keeps the account of the energy that the network has made, for the passivity layer."""

    def apply(self, period: Period) -> None:
        """Fill in `passivity`."""
        state, now, before = period.state, period.sight, period.state.sight
        if period.settings.max_damping <= 0.0 or now is None or before is None:
            return
        assert period.fade is not None
        stored, C = period.local.stored, period.compliance
        if C is not None:
            stored += stored_by_friction(period.friction, period.law_force, C)
        stored = given_share(stored, period.given_ratio, period.safety.scale)
        from_body = work_of_body(before, now, period.fade, period.moved_in, friction=C is not None)
        on_hand = 0.5 * dot(add(state.safety.force, period.safety.force), period.moved)
        memory = state.passivity
        owed = observe(memory.owed, on_hand, stored - memory.stored, from_body, period.dt)
        period.passivity = Passivity(owed, period.damping, stored)


def stored_by_friction(friction: FrictionState, force: Vec3, C: Compliance3) -> float:
    """Return the energy in the contact's 3x3 spring beyond that of its normal force alone [J].

    Args:
        friction: State of the friction after the period.
        force: Sum of normal and friction force [N].
        C: Compliance matrix of the contact [m/N].
    """
    # The energy f C f / 2 for the whole force f, less the energy for the normal force alone.
    normal_force = sub(force, friction.force)
    both = add(force, normal_force)
    return 0.5 * dot(friction.force, times(C, both)) / max(friction.share, 1e-9)


def work_of_body(
    before: Sight, now: Sight, fade: LawFade, moved_in: float, *, friction: bool
) -> float:
    """Return the work of the body in one period: the force it carries times its displacement [J].

    Args:
        before: Sample of the shown surface at the probe in the last period.
        now: The same sample in this period.
        fade: Law in use, after this period.
        moved_in: Displacement of the hand into the surface [m].
        friction: Whether the displacement of the material along the surface counts, too.
    """
    # The mean of both ends of the period, as for the work on the hand.
    own_force = scale(add(before.own_force, now.own_force), 0.5)
    own_normal_force = dot(own_force, now.normal)
    # The hand's own displacement changes the depth, too; the remainder is the surface's.
    law = fade.now.law
    towards_hand = pressed_depth(law, now) - pressed_depth(law, before) - moved_in
    if fade.before is not None:
        # During a transition each of the two laws contributes its part of the force.
        law = fade.before.law
        old = pressed_depth(law, now) - pressed_depth(law, before) - moved_in
        towards_hand = old + fade.share * (towards_hand - old)
    work = own_normal_force * towards_hand
    if friction:
        way = sub(now.u_others, before.u_others)
        work += dot(own_force, way) - own_normal_force * dot(now.normal, way)
    return work


class ToBody(Rule):
    """Gives the body the law's force in the share that the hand was given, and moves the models."""

    def apply(self, period: Period) -> None:
        """Fill in `on_body` and `give`, and replace `replica`."""
        limits = period.settings.limits
        period.on_body = on_body(period.law_force, period.given_ratio, limits.max_force)
        replica, answered = period.replica, period.answered
        if replica is not None and answered is not None:
            period.give = replica.gives[0].y
            pressed = dot(period.on_body, period.normal)
            period.replica = move(replica, answered, pressed, period.counted, period.recent)


def on_body(force: Vec3, ratio: float, max_force: float) -> Vec3:
    """Return the force of law and friction, reduced as the force on the hand is reduced [N].

    The body gets the opposite force. Damping is left out, because it concerns only the hand: it may
    cancel nearly all of the law's force, or double it. While the hand's force is still larger than
    the law's and falls towards it, the result is the law's force.

    Args:
        force: Force of the law and the friction [N].
        ratio: Force given to the hand, divided by the requested force.
        max_force: Largest force on the hand [N].
    """
    size = norm(force)
    if not size < math.inf:  # NaN too
        return ZERO
    share = min(1.0, ratio)
    return scale(force, max_force / size if size * share > max_force else share)


class Trusted(Rule):
    """Counts the energy that the contact returns to the hand; too much takes the models' share."""

    def apply(self, period: Period) -> None:
        """Fill in `trust`."""
        trust = period.state.trust
        if period.replica is not None or trust.made > 0.0 or trust.share < 1.0:
            force = dot(period.safety.force, period.normal)
            period.trust = trusted(trust, force, -period.moved_in, period.dt)
