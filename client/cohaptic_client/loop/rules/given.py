"""Rules on what the body gets of the force on the hand, and the accounts that are kept of it."""

from __future__ import annotations

import math

from cohaptic.control.friction import Compliance3, FrictionState, times
from cohaptic.control.geometry import Sight
from cohaptic.control.law import pressed_depth
from cohaptic.vec import ZERO, Vec3, add, dot, norm, scale, sub
from cohaptic_client.loop.law_fade import LawFade
from cohaptic_client.loop.passivity import Passivity, given_energy, observe
from cohaptic_client.loop.period import Period
from cohaptic_client.loop.replica import move
from cohaptic_client.loop.rule import Rule
from cohaptic_client.loop.trust import trusted


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
        stored = given_energy(stored, period.given_ratio, period.safety.scale)
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
    return 0.5 * dot(friction.force, times(C, both)) / max(friction.fraction, 1e-9)


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
        towards_hand = old + fade.fraction * (towards_hand - old)
    work = own_normal_force * towards_hand
    if friction:
        way = sub(now.u_others, before.u_others)
        work += dot(own_force, way) - own_normal_force * dot(now.normal, way)
    return work


class ToBody(Rule):
    """Gives the body the law's force in the share that the hand was given, and moves the models."""

    def apply(self, period: Period) -> None:
        """Fill in `on_body` and `deflection`, and replace `replica`."""
        limits = period.settings.limits
        period.on_body = on_body(period.law_force, period.given_ratio, limits.max_force)
        replica, answered = period.replica, period.answered
        if replica is not None and answered is not None:
            period.deflection = replica.deflections[0].y
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
    fraction = min(1.0, ratio)
    return scale(force, max_force / size if size * fraction > max_force else fraction)


class Trusted(Rule):
    """Counts the energy that the contact returns to the hand; too much takes the models' share."""

    def apply(self, period: Period) -> None:
        """Fill in `trust`."""
        trust = period.state.trust
        if period.replica is not None or trust.made > 0.0 or trust.fraction < 1.0:
            force = dot(period.safety.force, period.normal)
            period.trust = trusted(trust, force, -period.moved_in, period.dt)
