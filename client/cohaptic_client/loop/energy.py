"""Energy balance of a contact's spring with the body and the hand, for the passivity layer."""

from __future__ import annotations

from cohaptic.control.friction import Compliance3, FrictionState, times
from cohaptic.control.geometry import Sight
from cohaptic.control.law import pressed_depth
from cohaptic.vec import Vec3, add, dot, scale, sub
from cohaptic_client.loop.contact import Contact
from cohaptic_client.loop.law_fade import LawFade
from cohaptic_client.loop.passivity import Passivity, given_share, observe
from cohaptic_client.loop.safety import SafetyState
from cohaptic_client.loop.state import LoopState


def balance(
    state: LoopState,
    contact: Contact,
    before: Sight,
    now: Sight,
    safety: SafetyState,
    given_ratio: float,
    dt: float,
) -> Passivity:
    """Return the memory of the passivity layer after one period.

    Args:
        state: State after the last period.
        contact: Contact in this period.
        before: Surface under the probe in the last period.
        now: Surface under the probe in this period.
        safety: State of the safety layer after this period.
        given_ratio: Force given to the hand over the requested force.
        dt: Time since the last period [s].
    """
    assert contact.fade is not None
    stored, C = contact.local.stored, contact.compliance
    if C is not None:
        stored += stored_by_friction(contact.friction, contact.law_force, C)
    stored = given_share(stored, given_ratio, safety.scale)
    from_body = work_of_body(before, now, contact.fade, contact.moved_in, friction=C is not None)
    on_hand = 0.5 * dot(add(state.safety.force, safety.force), contact.moved)
    memory = state.passivity
    owed = observe(memory.owed, on_hand, stored - memory.stored, from_body, dt)
    return Passivity(owed, contact.damping, stored)


def stored_by_friction(friction: FrictionState, force: Vec3, C: Compliance3) -> float:
    """Energy that the contact's 3x3 spring stores beyond that of its normal force alone [J].

    Args:
        friction: Memory of the contact after the period.
        force: Sum of normal and friction force [N].
        C: Compliance of the contact [m/N].
    """
    # f C f / 2 of the whole force, less the same of the normal force alone.
    normal_force = sub(force, friction.force)
    both = add(force, normal_force)
    return 0.5 * dot(friction.force, times(C, both)) / max(friction.share, 1e-9)


def work_of_body(
    before: Sight, now: Sight, fade: LawFade, moved_in: float, *, friction: bool
) -> float:
    """Work of the body in one period: the force it carries times the way of its surface [J].

    Args:
        before: Surface under the probe in the last period.
        now: Surface under the probe in this period.
        fade: Law in use, after this period.
        moved_in: Way of the hand into the surface [m].
        friction: Whether the material's way along the surface counts.
    """
    # The mean of both ends of the period, as for the work on the hand.
    own_force = scale(add(before.own_force, now.own_force), 0.5)
    own_normal_force = dot(own_force, now.normal)
    # The hand's own way changes the depth too; the remainder is the surface's way.
    law = fade.now.law
    towards_hand = pressed_depth(law, now) - pressed_depth(law, before) - moved_in
    if fade.before is not None:
        # During the change from one law to the next, each contributes its share of the force.
        law = fade.before.law
        old = pressed_depth(law, now) - pressed_depth(law, before) - moved_in
        towards_hand = old + fade.share * (towards_hand - old)
    work = own_normal_force * towards_hand
    if friction:
        way = sub(now.u_others, before.u_others)
        work += dot(own_force, way) - own_normal_force * dot(now.normal, way)
    return work
