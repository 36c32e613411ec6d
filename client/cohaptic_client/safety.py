"""The last thing before the device: limits that hold whatever law, network or device did.

One function, applied once. A force that is not finite, a stalled loop or a hand that moves too fast
means zero at once, and force again only after the hand has been out of the object. A silent server
fades the force; its return raises it again. What is left is clamped and limited in its rate.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from cohaptic.vec import ZERO, Vec3, add, dot, is_finite, norm, scale, sub


@dataclass(frozen=True, slots=True)
class SafetyLimits:
    """What a hand may be given.

    Args:
        max_force: Magnitude [N].
        max_rate: Change per second; never limits a change towards zero [N/s].
        max_speed: Of the hand [m/s].
        stall: A period longer than this is a fault [s].
        silent_after: Without a patch for this long the server counts as silent [s].
        fade_time: From full force to none when it is [s].
        engage_time: From none to full at the start and after a fault or silence [s].
        engage_below: Force that the law may ask for when the hand is first engaged [N].
        engage_periods: For how many periods it must be below that.
    """

    max_force: float = 10.0
    max_rate: float = 1000.0
    max_speed: float = 1.5
    stall: float = 0.02
    silent_after: float = 0.1
    fade_time: float = 0.15
    engage_time: float = 1.0
    engage_below: float = 0.2
    engage_periods: int = 4


class Mode(Enum):
    """Whether the hand is engaged."""

    WAITING = "waiting"
    ENGAGED = "engaged"


@dataclass(frozen=True, slots=True)
class SafetyState:
    """Memory of the safety layer.

    Args:
        mode: WAITING at the start and after every fault.
        scale: Share of the wanted force that is given, 0 to 1.
        force: Given in the last period [N].
        quiet: Periods in a row in which the wanted force was small.
        now: Time of the last period [s]; None before the first.
        fault: What caused the last return to WAITING; empty for none.
    """

    mode: Mode = Mode.WAITING
    scale: float = 0.0
    force: Vec3 = ZERO
    quiet: int = 0
    now: float | None = None
    fault: str = ""


def guard(
    state: SafetyState,
    wanted: Vec3,
    *,
    now: float,
    velocity: Vec3,
    silent: bool,
    limits: SafetyLimits,
) -> SafetyState:
    """The force that the device gets, as `force` of the next state.

    Args:
        state: After the last period.
        wanted: Force that the law asks for [N].
        now: Time of this period [s].
        velocity: Of the hand [m/s].
        silent: Whether the server has been silent for too long.
        limits: Of this hand.
    """
    dt = 0.0 if state.now is None else now - state.now
    fault = _fault(wanted, velocity, dt, limits)
    if fault:
        return SafetyState(now=now, fault=fault)
    size = norm(wanted)
    quiet = state.quiet + 1 if size < limits.engage_below else 0
    engaged = state.mode is Mode.ENGAGED or (quiet >= limits.engage_periods and not silent)
    if engaged and not silent:
        share = min(1.0, state.scale + dt / limits.engage_time)
    else:
        share = max(0.0, state.scale - dt / limits.fade_time)
    force = scale(wanted, share)
    if size * share > limits.max_force:
        force = scale(wanted, limits.max_force / size)
    force = _limit_rate(state.force, force, limits.max_rate * dt)
    mode = Mode.ENGAGED if engaged else Mode.WAITING
    return SafetyState(mode, share, force, quiet, now, "" if engaged else state.fault)


def _fault(wanted: Vec3, velocity: Vec3, dt: float, limits: SafetyLimits) -> str:
    """Why the force must be zero now; empty when it need not."""
    if not is_finite(wanted):
        return f"the law asked for {wanted} N"
    if not is_finite(velocity) or norm(velocity) > limits.max_speed:
        return f"the hand moved at {norm(velocity):.2f} m/s, above {limits.max_speed:g} m/s"
    if dt > limits.stall:
        return f"the loop stood still for {1e3 * dt:.0f} ms, above {1e3 * limits.stall:g} ms"
    return ""


def _limit_rate(before: Vec3, after: Vec3, step: float) -> Vec3:
    """Move from `before` to `after` by at most `step`, the way towards zero not counted."""
    size2 = dot(before, before)
    # The nearest to `after` on the way from `before` to zero: as far as that, nothing holds back.
    share = min(1.0, max(0.0, dot(after, before) / size2)) if size2 > 0.0 else 0.0
    start = scale(before, share)
    change = sub(after, start)
    size = norm(change)
    return after if size <= step else add(start, scale(change, step / size))
