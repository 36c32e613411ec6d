"""One period of the haptic loop as a pure function, and the arrival of a patch as another.

An hour of haptics is a `for` loop in a test.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import NamedTuple

from cohaptic.control.friction import (
    NO_FRICTION,
    Compliance3,
    FrictionState,
    friction_step,
    normal_shift,
    times,
)
from cohaptic.control.geometry import LocalSurface, Sight, Surface, blend, difference, shift
from cohaptic.control.law import NO_FORCE, Gains, Law, LawSettings, LocalForce, pressed_depth
from cohaptic.protocol.patch import MIN_COMPLIANCE, Patch
from cohaptic.vec import ZERO, Vec3, add, dot, norm, scale, sub
from cohaptic_client.devices.device import DeviceSample
from cohaptic_client.loop.law_fade import (
    LAW_FADE_RATE,
    LawFade,
    Running,
    run,
    switch,
    with_gains,
)
from cohaptic_client.loop.passivity import Passivity, dissipate, given_share, observe
from cohaptic_client.loop.safety import (
    EXTERNAL_RATE,
    FADE_RATE,
    NEVER_ENGAGED,
    SafetyLimits,
    SafetyState,
    guard,
)
from cohaptic_client.loop.slew import SOFT, hold_back, slew_compliance, slew_gain, slew_normal

_NOTHING_OWED = Passivity()
MOST_CHANGE = 2.0  # of a compliance within one patch; more is a mistake of the patch
# Times the longest gap between patches of late: so long a silence is the link's way, not an end.
PATIENCE = 2.0
LONGEST_PATIENCE = 1.0  # s; no link that is worth touching over is silent for longer
FORGET_GAPS = 30.0  # s


def flat_surface(patch: Patch) -> LocalSurface:
    """Plane or sphere of a patch."""
    return LocalSurface(
        patch.x_free, patch.normal, patch.curvature, patch.c_ii, patch.own_force, patch.u_others
    )


@dataclass(frozen=True, slots=True)
class LoopSettings:
    """What one client's loop is told.

    Args:
        simulation_period: Time between patches, N T [s].
        limits: Of the safety layer.
        law: Of the integral of `Law.PI`.
        smoothing: Share of a simulation period over which the loop moves to a new patch; 0 holds
            it as the paper does, with a step of the surface at every patch.
        max_damping: Of the passivity layer; 0 switches it off [N s/m].
        surface: Makes the local surface of a patch.
        friction: mu of the contact; 0 for none.
        follow: Whether gains follow the compliance under a sliding probe; not those that the user
            has fixed.
        max_stiffness: Largest gain that the device renders stably [N/m].
    """

    simulation_period: float
    limits: SafetyLimits
    law: LawSettings = field(default_factory=LawSettings)
    smoothing: float = 1.0
    max_damping: float = 0.0
    surface: Callable[[Patch], Surface] = flat_surface
    friction: float = 0.0
    follow: bool = True
    max_stiffness: float = math.inf


class LoopState(NamedTuple):
    """Memory of the loop. A tuple: three times as fast to make, and this runs every period.

    Fields:
        patch: Newest patch; None before the first.
        arrived: When it came [s].
        before: Surface of the patch before.
        offset: What was shown when the newest came, less what `before` shows.
        surface: Surface of the newest; None before the first.
        k_h_before: Gain in use when it came [N/m].
        fade: Law in use; None before the first patch.
        normal_force: Of the law in the last period [N].
        sight: Shown in the last period; None before the first.
        depth: On which the law pressed in the last period, `hold_back` [m].
        probe: Of the last period [m].
        normal: Along which the law pressed in the last period, `turn_back`.
        passivity: Memory of the passivity layer.
        friction: Memory of the sticking contact.
        compliance: That the friction uses, on its way to the newest patch's; None without one.
        safety: Memory of the safety layer.
        patience: How long the server may be silent on this link [s].
    """

    patch: Patch | None = None
    arrived: float = -math.inf
    before: Surface | None = None
    offset: Sight | None = None
    surface: Surface | None = None
    k_h_before: float = 0.0
    fade: LawFade | None = None
    normal_force: float = 0.0
    sight: Sight | None = None
    depth: float = -math.inf
    probe: Vec3 = ZERO
    normal: Vec3 = (0.0, 0.0, 1.0)
    passivity: Passivity = _NOTHING_OWED
    friction: FrictionState = NO_FRICTION
    compliance: Compliance3 | None = None
    safety: SafetyState = NEVER_ENGAGED
    patience: float = 0.0

    @property
    def k_h(self) -> float:
        """Gain in use [N/m]; 0 before the first patch."""
        return self.fade.now.gains.k_h if self.fade else 0.0

    @property
    def law(self) -> Law | None:
        """Law in use."""
        return self.fade.now.law if self.fade else None


class Output(NamedTuple):
    """What a period gives.

    Fields:
        force: On the hand, to the device [N].
        on_body: The same without the passivity layer's damping, which is the hand's affair: what
            the body gets [N].
        local: What the law said.
        damping_force: Of the passivity layer, along the normal [N].
        u_others: Displacement of the contact point by the others, along the normal [m].
        silent: Whether the server counts as silent.
    """

    force: Vec3
    on_body: Vec3
    local: LocalForce
    damping_force: float
    u_others: float
    silent: bool


def receive(state: LoopState, patch: Patch, now: float, settings: LoopSettings) -> LoopState:
    """Take a patch in; an older one than the newest is left out.

    Surface and gain move to the new patch over one simulation period, from what is shown now.
    (Half of it would make forces 4 ms younger at 60 Hz, and coupled hands settle several times more
    slowly: the line is also a filter. Stability goes before transparency.)
    """
    # After a silence it may be another server's: one that was started anew counts from 1.
    silent = _is_silent(state, now, settings)
    if state.patch is not None and patch.tick <= state.patch.tick and not silent:
        return state
    surface = settings.surface(patch)
    gains = Gains(min(patch.k_h, settings.max_stiffness), patch.integral_gain)
    gap = now - state.arrived
    patience = next_patience(state.patience, gap) if gap < math.inf else state.patience
    if state.fade is None:
        fade = LawFade(Running(patch.law, gains))
    else:
        fade = switch(state.fade, patch.law, gains, force=state.normal_force, sight=state.sight)
    before, offset = state.surface, None
    at_arrival = shown(state, state.probe, now, settings)
    if before is not None and at_arrival is not None:
        offset = difference(at_arrival, before.look(state.probe))
    return state._replace(
        patch=patch,
        arrived=now,
        before=before,
        offset=offset,
        surface=surface,
        k_h_before=fade.now.gains.k_h,
        fade=fade,
        patience=patience,
    )


def next_patience(patience: float, gap: float) -> float:
    """How long the server may be silent, after one more patch [s].

    Args:
        patience: Before it [s].
        gap: Time since the patch before [s].
    """
    kept = patience * math.exp(-gap / FORGET_GAPS)
    if gap > LONGEST_PATIENCE:
        return kept  # an outage, which says nothing of the link's way
    return min(LONGEST_PATIENCE, max(PATIENCE * gap, kept))


def shown(state: LoopState, probe: Vec3, now: float, settings: LoopSettings) -> Sight | None:
    """What a probe sees at `now`, on the way from the patch before to the newest."""
    if state.surface is None:
        return None
    sight = state.surface.look(probe)
    share = _progress(state, now, settings)
    if share >= 1.0 or state.before is None:
        return sight
    return blend(shift(state.before.look(probe), state.offset), sight, share)


def _progress(state: LoopState, now: float, settings: LoopSettings) -> float:
    """How far the way to the newest patch is gone, 0 to 1."""
    way = settings.smoothing * settings.simulation_period
    return min(1.0, (now - state.arrived) / way) if way > 0.0 else 1.0


def step(
    state: LoopState, sample: DeviceSample, now: float, settings: LoopSettings
) -> tuple[LoopState, Output]:
    """One haptic period: from a device's sample to the force it gets.

    Args:
        state: After the last period.
        sample: Of the device.
        now: Time of this period [s].
        settings: Of the loop.
    """
    dt = 0.0 if state.safety.now is None else max(0.0, now - state.safety.now)
    # A late period moves the force by no more than two punctual ones.
    counted = min(dt, 2.0 * settings.limits.period)
    pace = EXTERNAL_RATE * counted
    silent = _is_silent(state, now, settings)
    sight = shown(state, sample.position, now, settings)
    local, wanted, from_law, damped, damping = NO_FORCE, ZERO, ZERO, 0.0, 0.0
    fade, friction, depth, normal = state.fade, NO_FRICTION, -math.inf, state.normal
    stored = from_body = 0.0
    C: Compliance3 | None = None
    if sight is not None and state.patch is not None and fade is not None:
        normal = sight.normal
        if state.patch.law is fade.now.law:
            was = fade.now.gains.k_h
            fade = _with_gains_of_patch(state, fade, sight, now, counted, settings)
            # What a change of gain or a fade of the safety layer moves is not the surface's.
            pace -= abs(fade.now.gains.k_h - was) * max(0.0, state.depth)
        if silent or state.safety.scale < 1.0:
            pace -= FADE_RATE * counted
        if fade.before is not None:
            pace -= LAW_FADE_RATE * counted
        pace = max(0.0, pace)
        if settings.friction > 0.0:
            pace *= 0.5  # the other half is the friction's
            C = slew_compliance(
                state.compliance,
                state.patch.compliance,
                state.friction,
                state.normal_force,
                counted / settings.simulation_period,
                0.5 * pace,
            )
        k_h = fade.now.gains.k_h
        moved = sub(sample.position, state.probe)
        if state.normal_force > 0.0 and normal != state.normal:
            if sight.depth > 0.0:
                force = min(state.normal_force, settings.limits.max_force)
                normal, pace = slew_normal(state.normal, normal, moved, k_h, force, pace)
            else:
                normal = state.normal  # a force that is to go need not turn any more
        moved_in = -dot(normal, moved)
        depth = sight.depth
        if state.sight is not None and state.safety.scale > 0.0:
            depth = hold_back(state.depth + moved_in, depth, pace / max(k_h, SOFT))
        aside = 0.0 if C is None else normal_shift(state.friction, normal, C)
        pressed = sight if depth - aside == sight.depth else _pressed(sight, depth - aside)
        fade, local = run(fade, pressed, counted, settings.law)
        damped = local.normal_force
        if state.sight is not None and settings.max_damping > 0.0:
            damping, damped = dissipate(
                state.passivity.owed,
                state.passivity.damping,
                damped,
                -dot(normal, sample.velocity),
                counted,
                settings.max_damping,
            )
        stored = local.stored
        if C is not None:
            share = min(1.0, k_h * sight.c_ii)
            friction = friction_step(
                state.friction,
                sub(moved, _turned(state)),
                sight.u_others,
                normal,
                local.normal_force,
                C,
                settings.friction,
                share,
                settings.max_stiffness,
                0.5 * pace,
            )
            from_law = add(scale(normal, local.normal_force), friction.force)
            stored += _stored_along(friction.force, from_law, C, friction.share)
            wanted = add(scale(normal, damped), friction.force)
        else:
            from_law = scale(normal, local.normal_force)
            wanted = scale(normal, damped)
        if state.sight is not None:
            from_body = _from_body(state.sight, sight, fade, moved_in, C is not None)
    safety = guard(
        state.safety,
        wanted,
        now=now,
        velocity=sample.velocity,
        silent=silent,
        limits=settings.limits,
    )
    size = damped if C is None else norm(wanted)
    ratio = norm(safety.force) / size if size > 0.0 else safety.scale
    passivity = _NOTHING_OWED
    if settings.max_damping > 0.0 and state.sight is not None:
        stored = given_share(stored, ratio, safety.scale)
        work = 0.5 * dot(add(state.safety.force, safety.force), sub(sample.position, state.probe))
        before = state.passivity
        owed = observe(before.owed, work, stored - before.stored, from_body, dt)
        passivity = Passivity(owed, damping, stored)
    after = LoopState(
        state.patch,
        state.arrived,
        state.before,
        state.offset,
        state.surface,
        state.k_h_before,
        fade,
        local.normal_force,
        sight,
        depth,
        sample.position,
        normal,
        passivity,
        friction,
        C,
        safety,
        state.patience,
    )
    output = Output(
        safety.force,
        on_body(from_law, ratio, settings.limits.max_force),
        local,
        damped - local.normal_force,
        dot(sight.u_others, sight.normal) if sight else 0.0,
        silent,
    )
    return after, output


def _turned(state: LoopState) -> Vec3:
    """From the tip out to where the surface was over it in the last period, for the law [m].

    The anchor lies so deep under the tip's way along the surface. Where the surface has turned
    since, a part of that depth is a way along it.
    """
    if state.sight is None or not state.friction.touching:
        return ZERO
    return scale(state.normal, max(0.0, state.depth))


def on_body(force: Vec3, ratio: float, max_force: float) -> Vec3:
    """What the body gets of the law's force: the share that the hand has, and never more [N].

    Damping may take nearly all of the law's force, or double it, and is not the body's affair; and
    while a force still comes down to the law's, the body has the law's.

    Args:
        force: Of the law and the friction [N].
        ratio: Force that the hand is given over the one that it was to have.
        max_force: Of the hand [N].
    """
    size = norm(force)
    if not math.isfinite(size):
        return ZERO
    share = min(1.0, ratio)
    return scale(force, max_force / size if size * share > max_force else share)


def _pressed(sight: Sight, depth: float) -> Sight:
    """The same surface with the probe at another depth below it."""
    return Sight(depth, sight.normal, sight.c_ii, sight.own_force, sight.u_others)


def _with_gains_of_patch(
    state: LoopState,
    fade: LawFade,
    sight: Sight,
    now: float,
    counted: float,
    settings: LoopSettings,
) -> LawFade:
    """The law in use with the gains of the newest patch, on the way from those before."""
    assert state.patch is not None
    newest = gains_under(state.patch, sight, settings)
    share = _progress(state, now, settings)
    target = state.k_h_before + share * (newest.k_h - state.k_h_before)
    k_h = slew_gain(fade.now.gains.k_h, target, counted, state.normal_force)
    return with_gains(fade, Gains(k_h, newest.integral_gain))


def _stored_along(along: Vec3, force: Vec3, C: Compliance3, share: float) -> float:
    """What the contact's 3x3 spring stores beside its normal one [J].

    Args:
        along: Friction force [N].
        force: Friction and normal force [N].
        C: Compliance of the contact.
        share: Of the body's stiffness that the law uses.
    """
    # f C f / 2 over all of f, less the part of the normal force alone.
    normal = sub(force, along)
    return 0.5 * dot(along, times(C, add(force, normal))) / max(share, 1e-9)


def _from_body(before: Sight, now: Sight, fade: LawFade, moved_in: float, sticks: bool) -> float:
    """What the body gave in a period: its own force of this client times the surface's way [J]."""
    # The mean of both ends, as for the work on the hand.
    both = scale(add(before.own_force, now.own_force), 0.5)
    own = dot(both, now.normal)
    # The probe's own way changes the depth too; what is left is the surface's.
    law = fade.now.law
    towards_hand = pressed_depth(law, now) - pressed_depth(law, before) - moved_in
    if fade.before is not None:
        # On the way from one law to the next each has its part of the force.
        law = fade.before.law
        other = pressed_depth(law, now) - pressed_depth(law, before) - moved_in
        towards_hand = other + fade.share * (towards_hand - other)
    given = own * towards_hand
    if sticks:
        way = sub(now.u_others, before.u_others)
        given += dot(both, way) - own * dot(now.normal, way)
    return given


def gains_under(patch: Patch, sight: Sight, settings: LoopSettings) -> Gains:
    """The gains of a patch for the place where the probe is now.

    They are shares of 1 / C_ii, which changes along a body: from the balloon's equator to its pole
    by half. A mesh patch knows it under the probe; the others know their own contact's.
    """
    if not settings.follow:
        return Gains(min(patch.k_h, settings.max_stiffness), patch.integral_gain)
    least, most = patch.c_ii / MOST_CHANGE, patch.c_ii * MOST_CHANGE
    c_ii = max(MIN_COMPLIANCE, least, min(most, sight.c_ii))
    if patch.law is Law.PREDICTIVE:
        # The object's stiffness here, or the device's where the server says that it is softer.
        limit = settings.max_stiffness
        if patch.k_h * patch.c_ii < _AS_STIFF:
            limit = min(limit, patch.k_h)
        return Gains(min(1.0 / c_ii, limit), patch.integral_gain)
    ratio = patch.c_ii / c_ii
    k_h = min(patch.k_h * ratio, settings.max_stiffness)
    return Gains(k_h, patch.integral_gain * ratio)


_AS_STIFF = 1.0 - 1e-5  # K_h C_ii of a hand that has the object's own stiffness, in 32 bits


def _is_silent(state: LoopState, now: float, settings: LoopSettings) -> bool:
    """Whether the newest patch is so old that the server counts as silent.

    On a link that jitters the force would else be faded again and again, and every fade is a pulse
    for the others. The local surface is passive by itself: there is no hurry.
    """
    return now - state.arrived > max(settings.limits.silent_after, state.patience)
