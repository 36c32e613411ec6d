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
from cohaptic.vec import ZERO, Vec3, add, dot, norm, scale, sub, unit
from cohaptic_client.devices.device import DeviceSample
from cohaptic_client.law_fade import LawFade, Running, run, switch, with_gains
from cohaptic_client.passivity import Passivity, dissipate, given_share, observe
from cohaptic_client.safety import (
    EXTERNAL_RATE,
    FADE_RATE,
    NEVER_ENGAGED,
    SafetyLimits,
    SafetyState,
    guard,
)

# A gain moves by at most 1 % per millisecond, and by `EXTERNAL_RATE` as far as the force knows.
GAIN_RATE = 10.0  # 1/s
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
    gains = Gains(patch.k_h, patch.integral_gain)
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
    dt = 0.0 if state.safety.now is None else now - state.safety.now
    # A late period moves the force by no more than two punctual ones.
    pace = EXTERNAL_RATE * min(dt, 2.0 * settings.limits.period)
    silent = _is_silent(state, now, settings)
    sight = shown(state, sample.position, now, settings)
    local, wanted, on_body, damped, damping = NO_FORCE, ZERO, ZERO, 0.0, 0.0
    fade, friction, depth, normal = state.fade, NO_FRICTION, -math.inf, state.normal
    stored = from_body = 0.0
    C = _compliance(state, dt, settings)
    if sight is not None and state.patch is not None and fade is not None:
        normal = sight.normal
        if state.patch.law is fade.now.law:
            was = fade.now.gains.k_h
            fade = _with_gains_of_patch(state, fade, sight, now, dt, settings)
            # What a change of gain or a fade of the safety layer moves is not the surface's.
            pace -= abs(fade.now.gains.k_h - was) * max(0.0, state.depth)
        if silent or state.safety.scale < 1.0:
            pace -= FADE_RATE * min(dt, 2.0 * settings.limits.period)
        if C is not None:
            pace *= 0.5  # the other half is the friction's
        pace = max(0.0, pace)
        k_h = fade.now.gains.k_h
        moved = sub(sample.position, state.probe)
        if state.normal_force > 0.0 and normal != state.normal:
            force, own = min(state.normal_force, settings.limits.max_force), k_h * norm(moved)
            normal, turn = turn_back(state.normal, normal, (pace + own) / force)
            pace = max(0.0, pace - max(0.0, turn * force - own))
        moved_in = -dot(normal, moved)
        depth = sight.depth
        if state.sight is not None and state.safety.scale > 0.0:
            depth = hold_back(state.depth + moved_in, depth, pace / max(k_h, _SOFT))
        aside = 0.0 if C is None else normal_shift(state.friction, normal, C)
        pressed = sight if depth - aside == sight.depth else _pressed(sight, depth - aside)
        fade, local = run(fade, pressed, dt, settings.law)
        damped = local.normal_force
        if state.sight is not None and settings.max_damping > 0.0:
            damping, damped = dissipate(
                state.passivity.owed,
                state.passivity.damping,
                damped,
                -dot(normal, sample.velocity),
                dt,
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
                pace,
            )
            on_body = add(scale(normal, local.normal_force), friction.force)
            stored += _stored_along(friction.force, on_body, C, share)
            wanted = add(scale(normal, damped), friction.force)
        else:
            on_body = scale(normal, local.normal_force)
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
        scale(on_body, ratio),
        local,
        damped - local.normal_force,
        dot(sight.u_others, sight.normal) if sight else 0.0,
        silent,
    )
    return after, output


def _turned(state: LoopState) -> Vec3:
    """From the tip out to where the surface was over it in the last period [m].

    The anchor lies so deep under the tip's way along the surface. Where the surface has turned
    since, a part of that depth is a way along it.
    """
    if state.sight is None or not state.friction.touching:
        return ZERO
    return scale(state.sight.normal, max(0.0, state.depth))


_SOFT = 1.0  # N/m; what is softer gives no force that could step


def hold_back(depth: float, target: float, most: float) -> float:
    """Depth on which the law presses: what others do to the surface moves it by `most` at most [m].

    Args:
        depth: Of the last period, and the way that the hand itself went in since [m].
        target: Of the probe below the surface that is shown [m].
        most: Way of the surface in this period [m].
    """
    if depth <= 0.0 and target <= 0.0:
        return target  # out of contact there is no force to move
    start = max(0.0, depth)  # from where on there is one
    return min(max(target, start - most), start + most)


def turn_back(normal: Vec3, target: Vec3, most: float) -> tuple[Vec3, float]:
    """Direction of the force: what others do to the surface turns it by `most` at most.

    Args:
        normal: Of the last period.
        target: Of the surface that is shown.
        most: Turn in this period [rad].

    Returns:
        Unit normal to be used, and by how much it turned [rad].
    """
    change = sub(target, normal)
    size = norm(change)
    if size <= most:
        return target, size
    return unit(add(normal, scale(change, most / size)), target), most


def _pressed(sight: Sight, depth: float) -> Sight:
    """The same surface with the probe at another depth below it."""
    return Sight(depth, sight.normal, sight.c_ii, sight.own_force, sight.u_others)


def _with_gains_of_patch(
    state: LoopState, fade: LawFade, sight: Sight, now: float, dt: float, settings: LoopSettings
) -> LawFade:
    """The law in use with the gains of the newest patch, on the way from those before."""
    assert state.patch is not None
    newest = gains_under(state.patch, sight, settings)
    share = _progress(state, now, settings)
    target = state.k_h_before + share * (newest.k_h - state.k_h_before)
    k_h = slew_gain(fade.now.gains.k_h, target, dt, state.normal_force)
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
        return Gains(patch.k_h, patch.integral_gain)
    least, most = patch.c_ii / MOST_CHANGE, patch.c_ii * MOST_CHANGE
    c_ii = max(MIN_COMPLIANCE, least, min(most, sight.c_ii))
    if patch.law is Law.PREDICTIVE:
        # The object's stiffness here, or the device's where the server says that it is softer.
        limit = settings.max_stiffness
        if patch.k_h * patch.c_ii < _AS_STIFF:
            limit = min(limit, patch.k_h)
        return Gains(min(1.0 / c_ii, limit), patch.integral_gain)
    ratio = patch.c_ii / c_ii
    k_h = min(patch.k_h * ratio, max(settings.max_stiffness, patch.k_h))
    return Gains(k_h, patch.integral_gain * ratio)


_AS_STIFF = 1.0 - 1e-5  # K_h C_ii of a hand that has the object's own stiffness, in 32 bits


def _compliance(state: LoopState, dt: float, settings: LoopSettings) -> Compliance3 | None:
    """Compliance that the friction uses, on its way to the newest patch's."""
    newest = state.patch.compliance if state.patch else None
    if settings.friction <= 0.0 or newest is None or state.compliance is None:
        return newest if settings.friction > 0.0 else None
    s = min(1.0, dt / settings.simulation_period)
    return Compliance3(*(a + s * (b - a) for a, b in zip(state.compliance, newest, strict=True)))


def _is_silent(state: LoopState, now: float, settings: LoopSettings) -> bool:
    """Whether the newest patch is so old that the server counts as silent.

    On a link that jitters the force would else be faded again and again, and every fade is a pulse
    for the others. The local surface is passive by itself: there is no hurry.
    """
    return now - state.arrived > max(settings.limits.silent_after, state.patience)


def slew_gain(k_h: float, target: float, dt: float, force: float = 0.0) -> float:
    """Move a gain towards its target by at most `GAIN_RATE` of itself per second [N/m].

    Args:
        k_h: In the last period [N/m].
        target: Where it goes [N/m].
        dt: Time since the last period [s].
        force: That it makes now; it changes by at most half of `EXTERNAL_RATE` [N].
    """
    if target == k_h:
        return k_h
    rate = min(GAIN_RATE, 0.5 * EXTERNAL_RATE / force) if force > 0.0 else GAIN_RATE
    factor = math.exp(min(1.0, rate * dt))
    return min(max(target, k_h / factor), k_h * factor)
