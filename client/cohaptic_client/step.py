"""One period of the haptic loop as a pure function, and the arrival of a patch as another.

An hour of haptics is a `for` loop in a test.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

from cohaptic.control.geometry import LocalSurface, blend, normal_at
from cohaptic.control.law import NO_FORCE, Law, LocalForce, local_force
from cohaptic.protocol.patch import Patch
from cohaptic.vec import ZERO, Vec3, scale
from cohaptic_client.devices.device import DeviceSample
from cohaptic_client.safety import SafetyLimits, SafetyState, guard

# A gain moves by at most 1 % per millisecond: a new neighbour never jolts the hand.
GAIN_RATE = 10.0  # 1/s


@dataclass(frozen=True, slots=True)
class LoopSettings:
    """What one client's loop is told.

    Args:
        law: Local model.
        simulation_period: Time between patches, N T [s].
        limits: Of the safety layer.
    """

    law: Law
    simulation_period: float
    limits: SafetyLimits


@dataclass(frozen=True, slots=True)
class LoopState:
    """Memory of the loop.

    Args:
        patch: Newest patch; None before the first.
        arrived: When it came [s].
        before: Surface that was shown when it came; the next period starts from there.
        surface: Its surface; None before the first.
        k_h_before: Gain in use when it came [N/m].
        k_h: Gain in use [N/m].
        safety: Memory of the safety layer.
    """

    patch: Patch | None = None
    arrived: float = -math.inf
    before: LocalSurface | None = None
    surface: LocalSurface | None = None
    k_h_before: float = 0.0
    k_h: float = 0.0
    safety: SafetyState = field(default_factory=SafetyState)


@dataclass(frozen=True, slots=True)
class Output:
    """What a period gives.

    Args:
        force: On the hand, to the device [N].
        local: What the law said.
        u_others: Displacement of the contact point by the others, along the normal [m].
        silent: Whether the server counts as silent.
    """

    force: Vec3
    local: LocalForce
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
    surface = LocalSurface(
        patch.x_free, patch.normal, patch.curvature, patch.c_ii, patch.own_force, patch.u_others
    )
    return replace(
        state,
        patch=patch,
        arrived=now,
        before=shown(state, now, settings) or surface,
        surface=surface,
        k_h_before=state.k_h or patch.k_h,
        k_h=state.k_h or patch.k_h,
    )


def shown(state: LoopState, now: float, settings: LoopSettings) -> LocalSurface | None:
    """The surface at `now`, on its way from the patch before to the newest."""
    if state.surface is None or state.before is None:
        return None
    return blend(state.before, state.surface, _progress(state, now, settings))


def _progress(state: LoopState, now: float, settings: LoopSettings) -> float:
    """How far the way to the newest patch is gone, 0 to 1."""
    return min(1.0, (now - state.arrived) / settings.simulation_period)


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
    surface = shown(state, now, settings)
    local, wanted, k_h = NO_FORCE, ZERO, state.k_h
    if surface is not None and state.patch is not None:
        dt = 0.0 if state.safety.now is None else now - state.safety.now
        share = _progress(state, now, settings)
        target = state.k_h_before + share * (state.patch.k_h - state.k_h_before)
        k_h = slew_gain(state.k_h, target, dt)
        local = local_force(settings.law, surface, sample.position, k_h=k_h)
        wanted = scale(normal_at(surface, sample.position), local.normal_force)
    silent = _is_silent(state, now, settings)
    safety = guard(
        state.safety,
        wanted,
        now=now,
        velocity=sample.velocity,
        silent=silent,
        limits=settings.limits,
    )
    return replace(state, k_h=k_h, safety=safety), Output(
        safety.force, local, surface.u_others if surface else 0.0, silent
    )


def _is_silent(state: LoopState, now: float, settings: LoopSettings) -> bool:
    """Whether the newest patch is so old that the server counts as silent."""
    return now - state.arrived > settings.limits.silent_after


def slew_gain(k_h: float, target: float, dt: float) -> float:
    """Move a gain towards its target by at most `GAIN_RATE` of itself per second [N/m]."""
    factor = math.exp(min(1.0, GAIN_RATE * dt))
    return min(max(target, k_h / factor), k_h * factor)
