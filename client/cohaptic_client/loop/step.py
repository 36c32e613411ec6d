"""One period of the haptic loop as a pure function: an hour of haptics is a `for` loop in a test.

The steps of a period: the shown surface (`arrival`), the contact of the probe with it (`contact`),
the limits of the safety layer (`safety`), the energy balance (`balance`), and the results. The
energy balance is that of the contact's spring with the body and the hand, for the passivity layer
(`passivity`). A law that fails, a tip out of reach and a position that is not a number are faults:
the force is released, and the loop runs on.
"""

from __future__ import annotations

import math
from typing import Final

from cohaptic.control.friction import Compliance3, FrictionState, anchor_of, times
from cohaptic.control.geometry import Sight
from cohaptic.control.law import pressed_depth
from cohaptic.protocol.frame import MAX_POSITION
from cohaptic.protocol.patch import MAX_STIFFNESS
from cohaptic.vec import ZERO, Vec3, add, dot, norm, scale, sub
from cohaptic_client.devices.device import DeviceSample
from cohaptic_client.loop.answer import WISH_RATE, WISH_RATE_IN_FADES, Own, answer
from cohaptic_client.loop.arrival import is_silent, play, played, progress, shown
from cohaptic_client.loop.contact import NO_SURFACE, Contact, press
from cohaptic_client.loop.law_fade import LawFade, stiffest
from cohaptic_client.loop.passivity import NOTHING_OWED, SLOW, Passivity, given_share, observe
from cohaptic_client.loop.replica import NOT_MOVED, Answer, left_alone, move, recent_speed
from cohaptic_client.loop.safety import SafetyLimits, SafetyState, guard
from cohaptic_client.loop.state import LoopSettings, LoopState, Output
from cohaptic_client.loop.trust import trusted


def balance(
    state: LoopState,
    contact: Contact,
    before: Sight,
    now: Sight,
    safety: SafetyState,
    given_ratio: float,
    dt: float,
) -> Passivity:
    """Compute the energy balance of one period; return the new memory of the passivity layer.

    Args:
        state: State after the last period.
        contact: Contact in this period.
        before: Sample of the shown surface at the probe in the last period.
        now: The same sample in this period.
        safety: State of the safety layer after this period.
        given_ratio: Force given to the hand, divided by the requested force.
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


_CUT: Final = 0.95  # share of the law's force; a larger damping force counts as cut to that force
_SWITCH: Final = 1  # bit of `DeviceSample.buttons`
_REACH: Final = MAX_POSITION * MAX_POSITION  # m^2; largest squared distance of a tip
# N^2; square of the force of the stiffest surface at the greatest depth
_NO_FORCE: Final = (MAX_STIFFNESS * MAX_POSITION) ** 2


def step(
    state: LoopState, sample: DeviceSample, now: float, settings: LoopSettings
) -> tuple[LoopState, Output]:
    """Compute one haptic period, from a device's sample to the force that the device gets.

    Args:
        state: State after the last period.
        now: Time of this period [s].

    Returns:
        State after this period, and its results.
    """
    trouble = trouble_of(state, sample, now, settings.limits)
    if trouble and not norm(sample.position) <= MAX_POSITION:
        sample = DeviceSample(state.probe, sample.velocity, sample.level, sample.buttons)
    try:
        return _step(state, sample, now, settings, trouble)
    except (ArithmeticError, ValueError) as error:
        return without_surface(state, sample, now, settings, trouble or f"the law failed: {error}")


def trouble_of(state: LoopState, sample: DeviceSample, now: float, limits: SafetyLimits) -> str:
    """Describe the fault in a device's sample; empty if there is none.

    A fault is a position beyond `MAX_POSITION` or a jump of the tip. The check compares positions,
    because the driver may state any velocity: a tip that jumps has moved faster than `max_speed`,
    whatever the sample's velocity is.

    Args:
        state: State after the last period.
        now: Time of this period [s].
    """
    # Without calls, because this runs in every period and mostly finds nothing.
    (x, y, z), (x0, y0, z0) = sample.position, state.probe
    if not x * x + y * y + z * z <= _REACH:  # NaN too
        return f"the device is at {sample.position} m, beyond {MAX_POSITION:g} m"
    if state.safety.now is None:
        return ""
    passed = now - state.safety.now
    most = limits.max_speed * (passed + limits.stale if passed > 0.0 else limits.stale)
    if (x - x0) * (x - x0) + (y - y0) * (y - y0) + (z - z0) * (z - z0) > most * most:
        way = norm(sub(sample.position, state.probe))
        return f"the device jumped by {1e3 * way:.0f} mm, faster than {limits.max_speed:g} m/s"
    return ""


def without_surface(
    state: LoopState, sample: DeviceSample, now: float, settings: LoopSettings, fault: str
) -> tuple[LoopState, Output]:
    """Compute a period after a fault: release the force, and use no surface until the next patch.

    Args:
        state: State after the last period.
        now: Time of this period [s].
        fault: Reason why the force is released.

    Returns:
        State after this period, and its results.
    """
    safety = guard(
        state.safety, ZERO, now=now, velocity=sample.velocity, silent=True, limits=settings.limits,
        trouble=fault, held=sample.buttons & _SWITCH != 0,
    )  # fmt: skip
    replica = state.replica
    after = LoopState(
        patch=state.patch,
        arrived=min(state.arrived, now),  # a clock that goes back makes no patch younger
        probe=sample.position,
        safety=safety,
        patience=state.patience,
        replica=None if replica is None else left_alone(replica, settings.limits.period),
        trust=state.trust,
        playout=state.playout,
        coming=state.coming,
        move_begins=state.move_begins,
        move_ends=state.move_ends,
    )
    give = None if replica is None else replica.gives[0].y
    return after, Output(safety.force, ZERO, None, NO_SURFACE.local, 0.0, 0.0, True, give)


# Above 60 lines: the steps of a period in their order, and the memory of each of them.
def _step(
    state: LoopState, sample: DeviceSample, now: float, settings: LoopSettings, trouble: str
) -> tuple[LoopState, Output]:
    """Compute the period of `step` for a tip within reach.

    Raises:
        ArithmeticError, ValueError: The law fails.
    """
    limits = settings.limits
    dt = 0.0 if state.safety.now is None else max(0.0, now - state.safety.now)
    silent = is_silent(state, now, settings)
    if state.coming:
        state = play(state, now, settings)
    share = progress(state, now)
    sight = shown(state, sample.position, share)
    contact = NO_SURFACE
    replica, explained, wished = state.replica, 0.0, 0.0
    answered: Answer | None = None
    recent = NOT_MOVED
    if sight is not None and replica is not None:
        assert state.patch is not None
        moved_in = dot(sight.normal, sub(state.probe, sample.position))
        counted = min(dt, 2.0 * limits.period)
        recent = recent_speed(replica.recent, moved_in, counted)
        fades = silent or state.safety.scale < 1.0
        fades = fades or (state.fade is not None and state.fade.before is not None)
        own = Own(
            state.k_h, state.patch.c_ii, limits.max_force, state.safety.scale,
            settings.max_stiffness, moved_in, recent.speed,
            WISH_RATE_IN_FADES if fades else WISH_RATE, state.trust.share,
        )  # fmt: skip
        answered = answer(replica, sight, share, own, counted)
        sight, explained, wished = answered.sight, answered.explained, answered.wished
    if sight is not None:
        contact = press(state, sample, sight, share, dt, silent, settings, explained, wished)
        check_memory(contact)
    force = contact.requested_force
    safety = guard(
        state.safety, force, now=now, velocity=sample.velocity, silent=silent, limits=limits,
        trouble=trouble, held=sample.buttons & _SWITCH != 0,
        own=own_force(state, sample, contact, settings) + state.k_h * abs(explained),
        damping=max(contact.damping, state.passivity.damping),
    )  # fmt: skip
    size = contact.damped_force if contact.compliance is None else norm(force)
    given_ratio = norm(safety.force) / size if size > 0.0 else safety.scale
    passivity = NOTHING_OWED
    if settings.max_damping > 0.0 and sight is not None and state.sight is not None:
        passivity = balance(state, contact, state.sight, sight, safety, given_ratio, dt)
    pushed = on_body(contact.law_force, given_ratio, limits.max_force)
    give: float | None = None
    if replica is not None and answered is not None:
        give = replica.gives[0].y
        pressed = dot(pushed, contact.normal)
        replica = move(replica, answered, pressed, min(dt, 2.0 * limits.period), recent)
    trust = state.trust
    if replica is not None or trust.made > 0.0 or trust.share < 1.0:
        trust = trusted(trust, dot(safety.force, contact.normal), -contact.moved_in, dt)
    after = LoopState(
        patch=state.patch,
        arrived=state.arrived if state.arrived < now else now,
        before=state.before,
        offset=state.offset,
        surface=state.surface,
        k_h_before=state.k_h_before,
        fade=contact.fade,
        normal_force=contact.local.normal_force,
        sight=sight,
        depth=contact.depth,
        probe=sample.position,
        normal=contact.normal,
        passivity=passivity,
        friction=contact.friction,
        compliance=contact.compliance,
        safety=safety,
        patience=state.patience,
        replica=replica,
        trust=trust,
        playout=played(state, now, dt, settings),
        coming=state.coming,
        move_begins=state.move_begins,
        move_ends=state.move_ends,
    )
    output = Output(
        force=safety.force,
        on_body=pushed,
        anchor=told(anchor_of(contact.friction, sample.position, contact.normal, contact.depth)),
        local=contact.local,
        damping_force=contact.damped_force - contact.local.normal_force,
        u_others=dot(sight.u_others, sight.normal) if sight is not None else 0.0,
        silent=silent,
        give=give,
    )
    return after, output


def check_memory(contact: Contact) -> None:
    """Raise ValueError for a contact whose values must not stay in the loop's memory.

    A value that is not finite would stay there for ever, and a force larger than any spring can
    give would stay until it has faded.
    """
    (fx, fy, fz), (nx, ny, nz) = contact.requested_force, contact.normal
    whole = nx + ny + nz + contact.depth
    if not (fx * fx + fy * fy + fz * fz < _NO_FORCE and -math.inf < whole < math.inf):
        raise ValueError(f"{contact.requested_force} N at a depth of {contact.depth} m")


def own_force(
    state: LoopState, sample: DeviceSample, contact: Contact, settings: LoopSettings
) -> float:
    """Return the largest change of the force in a period that the hand's own motion explains [N].

    The contact's spring changes the force by the hand's displacement times the stiffness in the
    stiffest direction, into or along the surface. Friction adds mu times as much, at a right angle
    to the normal force. For a hand faster than `SLOW` the damping counts, too: the change may
    double while the damping force is cut to the law's force, and the damping may rise or fall. For
    a slower hand the damping does not count: such a hand has little energy to be taken out, and
    would feel little but the changes that a server causes.
    """
    fade = contact.fade
    way = norm(contact.moved)
    if way == 0.0:
        return 0.0
    stiffness = state.fade.now.gains.k_h if state.fade is not None else 0.0
    if fade is not None:
        along = min(contact.friction.stiffness, settings.max_stiffness)
        stiffness = max(stiffness, stiffest(fade), along)
    own = math.hypot(1.0, settings.friction) * stiffness * way
    law_force = contact.local.normal_force
    if contact.damping > 0.0 and law_force > 0.0:
        speed = norm(sample.velocity)
        if speed > SLOW:
            if abs(contact.damped_force - law_force) >= _CUT * law_force:
                own *= 2.0
            own += speed * abs(contact.damping - state.passivity.damping)
    return own


def told(anchor: Vec3 | None) -> Vec3 | None:
    """Return the anchor for the server [m]; None if it is out of reach or not a number."""
    if anchor is None or not norm(anchor) <= MAX_POSITION:  # NaN too
        return None
    return anchor


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
