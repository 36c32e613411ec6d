"""One period of the haptic loop as a pure function, and the arrival of a patch as another.

An hour of haptics is a `for` loop in a test.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace

from cohaptic.control.friction import Compliance3, FrictionState, friction_step, normal_shift
from cohaptic.control.geometry import LocalSurface, Sight, Surface, blend, difference, shift
from cohaptic.control.law import NO_FORCE, Gains, Law, LawSettings, LocalForce, pressed_depth
from cohaptic.protocol.patch import Patch
from cohaptic.vec import ZERO, Vec3, add, dot, norm, scale, sub
from cohaptic_client.devices.device import DeviceSample
from cohaptic_client.law_fade import LawFade, Running, run, switch, with_gains
from cohaptic_client.passivity import Passivity, dissipate, observe
from cohaptic_client.safety import SafetyLimits, SafetyState, guard

# A gain moves by at most 1 % per millisecond: a new neighbour never jolts the hand.
GAIN_RATE = 10.0  # 1/s
_NOTHING_OWED, _UNSTUCK = Passivity(), FrictionState()
MOST_CHANGE = 2.0  # of a compliance within one patch; more is a mistake of the patch


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


@dataclass(frozen=True, slots=True)
class LoopState:
    """Memory of the loop.

    Args:
        patch: Newest patch; None before the first.
        arrived: When it came [s].
        before: Surface of the patch before.
        offset: What was shown when the newest came, less what `before` shows.
        surface: Surface of the newest; None before the first.
        k_h_before: Gain in use when it came [N/m].
        fade: Law in use; None before the first patch.
        normal_force: Of the law in the last period [N].
        sight: Shown in the last period; None before the first.
        probe: Of the last period [m].
        passivity: Memory of the passivity layer.
        friction: Memory of the sticking contact.
        compliance: That the friction uses, on its way to the newest patch's; None without one.
        safety: Memory of the safety layer.
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
    probe: Vec3 = ZERO
    passivity: Passivity = _NOTHING_OWED
    friction: FrictionState = _UNSTUCK
    compliance: Compliance3 | None = None
    safety: SafetyState = field(default_factory=SafetyState)

    @property
    def k_h(self) -> float:
        """Gain in use [N/m]; 0 before the first patch."""
        return self.fade.now.gains.k_h if self.fade else 0.0

    @property
    def law(self) -> Law | None:
        """Law in use."""
        return self.fade.now.law if self.fade else None


@dataclass(frozen=True, slots=True)
class Output:
    """What a period gives.

    Args:
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
    if state.fade is None:
        fade = LawFade(Running(patch.law, gains))
    else:
        fade = switch(state.fade, patch.law, gains, force=state.normal_force, sight=state.sight)
    before, offset = state.surface, None
    at_arrival = shown(state, state.probe, now, settings)
    if before is not None and at_arrival is not None:
        offset = difference(at_arrival, before.look(state.probe))
    return replace(
        state,
        patch=patch,
        arrived=now,
        before=before,
        offset=offset,
        surface=surface,
        k_h_before=fade.now.gains.k_h,
        fade=fade,
    )


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
    sight = shown(state, sample.position, now, settings)
    local, wanted, on_body, damped = NO_FORCE, ZERO, ZERO, 0.0
    fade, passivity, friction = state.fade, state.passivity, FrictionState()
    C = _compliance(state, dt, settings)
    if sight is not None and state.patch is not None and fade is not None:
        if state.patch.law is fade.now.law:
            share = _progress(state, now, settings)
            newest = gains_under(state.patch, sight, settings)
            target = state.k_h_before + share * (newest.k_h - state.k_h_before)
            k_h = slew_gain(fade.now.gains.k_h, target, dt)
            fade = with_gains(fade, Gains(k_h, newest.integral_gain))
        pressed = sight
        if C is not None:
            aside = normal_shift(state.friction, sight.normal, C)
            pressed = sight._replace(depth=sight.depth - aside)
        fade, local = run(fade, pressed, dt, settings.law)
        passivity, damped = _keep_passive(
            state, sample, sight, fade.now.law, local.normal_force, dt, settings
        )
        if C is not None:
            moved = sub(sample.position, state.probe)
            stiff = min(1.0, fade.now.gains.k_h * sight.c_ii)
            friction = friction_step(
                state.friction,
                moved,
                sight.normal,
                local.normal_force,
                C,
                settings.friction,
                stiff,
            )
        wanted = add(scale(sight.normal, damped), friction.force)
        on_body = add(scale(sight.normal, local.normal_force), friction.force)
    silent = _is_silent(state, now, settings)
    safety = guard(
        state.safety,
        wanted,
        now=now,
        velocity=sample.velocity,
        silent=silent,
        limits=settings.limits,
    )
    # Constructed anew: `replace` takes several times as long, and this runs every millisecond.
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
        sample.position,
        passivity,
        friction,
        C,
        safety,
    )
    size = norm(wanted)
    output = Output(
        safety.force,
        scale(on_body, norm(safety.force) / size if size > 0.0 else safety.scale),
        local,
        damped - local.normal_force,
        sight.u_others if sight else 0.0,
        silent,
    )
    return after, output


def gains_under(patch: Patch, sight: Sight, settings: LoopSettings) -> Gains:
    """The gains of a patch for the place where the probe is now.

    They are shares of 1 / C_ii, which changes along a body: from the balloon's equator to its pole
    by half. A mesh patch knows it under the probe; the others know their own contact's.
    """
    ratio = 1.0
    if settings.follow and sight.c_ii > 0.0:
        ratio = min(MOST_CHANGE, max(1.0 / MOST_CHANGE, patch.c_ii / sight.c_ii))
    k_h = min(patch.k_h * ratio, max(settings.max_stiffness, patch.k_h))
    return Gains(k_h, patch.integral_gain * ratio)


def _compliance(state: LoopState, dt: float, settings: LoopSettings) -> Compliance3 | None:
    """Compliance that the friction uses, on its way to the newest patch's."""
    newest = state.patch.compliance if state.patch else None
    if settings.friction <= 0.0 or newest is None or state.compliance is None:
        return newest if settings.friction > 0.0 else None
    s = min(1.0, dt / settings.simulation_period)
    return Compliance3(*(a + s * (b - a) for a, b in zip(state.compliance, newest, strict=True)))


def _keep_passive(
    state: LoopState,
    sample: DeviceSample,
    sight: Sight,
    law: Law,
    force: float,
    dt: float,
    settings: LoopSettings,
) -> tuple[Passivity, float]:
    """Memory of the layer, and the normal force with the passivity layer's damping [N]."""
    if state.sight is None or settings.max_damping <= 0.0:
        return Passivity(), force
    # The probe's own way changes the depth too; what is left is the surface's.
    deeper = pressed_depth(law, sight) - pressed_depth(law, state.sight)
    moved = deeper + dot(sight.normal, sub(sample.position, state.probe))
    owed = observe(state.passivity.owed, force, sight.own_force, moved, dt)
    speed_in = -dot(sight.normal, sample.velocity)
    owed, damping, damped = dissipate(
        owed, state.passivity.damping, force, speed_in, dt, settings.max_damping
    )
    return Passivity(owed, damping), damped


def _is_silent(state: LoopState, now: float, settings: LoopSettings) -> bool:
    """Whether the newest patch is so old that the server counts as silent."""
    return now - state.arrived > settings.limits.silent_after


def slew_gain(k_h: float, target: float, dt: float) -> float:
    """Move a gain towards its target by at most `GAIN_RATE` of itself per second [N/m]."""
    factor = math.exp(min(1.0, GAIN_RATE * dt))
    return min(max(target, k_h / factor), k_h * factor)
