"""The last thing before the device: limits that hold whatever law, network or device did.

One function, applied once. A force that is not finite, a stalled loop or a hand that moves too fast
lets the hand go within `FAULT_RELEASE_TIME`, without a jerk, and force comes again only after the
hand has been out of the object. On a device with motors a fault stays until the user has
acknowledged it, too: what has failed once, unseen, must not come back by itself. A switch that is
not held lets the hand go as a fault does, and waits for nobody's word. A silent server fades the
force; its return raises it again. The resulting force is clamped, and limited in its rate both
ways: a force that vanishes is as much of a jolt as one that comes. And what the hand's own motion
does not explain moves it no faster than `EXTERNAL_RATE`, whatever the laws make of a patch. What it
does explain is for the force of the same period: no motion is saved up for a patch to spend later.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum
from typing import Final

from cohaptic.vec import ZERO, Vec3, add, is_finite, norm, scale, sub

# s from a fault to no force; 10 N are gone no faster than the rate allows
FAULT_RELEASE_TIME: Final = 0.02
# N/s; limit of all change of the force that the hand's own motion does not cause: 0.02 N in a
# millisecond, while a fingertip notices changes from about 0.05 N in 20 ms.
EXTERNAL_RATE: Final = 20.0
SAFETY_FADE_RATE: Final = 10.0  # N/s, part of `EXTERNAL_RATE`, for fades of this layer
# Of `EXTERNAL_RATE`, for all that the hand's own motion does not explain, whoever made it: a turn
# of the force adds a second order to its size.
BACKSTOP: Final = 1.02
FORGET_OWN: Final = 0.03  # s; a hand that was held back by `max_rate` has what it is owed by then


@dataclass(frozen=True, slots=True)
class SafetyLimits:
    """Limits of the force on a hand.

    Args:
        max_force: Magnitude [N].
        max_rate: Change per second, up or down [N/s].
        max_speed: Largest speed of the hand [m/s].
        stall: A period longer than this is a fault [s].
        silent_after: Without a patch for this long the server counts as silent [s].
        fade_time: From full force to none when it is, or longer, at `SAFETY_FADE_RATE` [s].
        engage_time: From none to full at the start and after a fault or silence [s].
        engage_below: Force that the law may ask for when the hand is first engaged [N].
        engage_periods: For how many periods it must be below that.
        period: T; a late period moves the force by no more than two of them would [s].
        stale: Age that a device's position may have: the tip may seem to jump by as much more than
            a hand moves in a period [s].
        latch: Whether a fault stays until the user acknowledges it.
        dead_man: Whether there is force only while the user holds the device's switch.
        external_rate: Limit of all change that the hand's own motion does not explain
            [N/s].
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
    period: float = 0.001
    stale: float = 0.002
    latch: bool = False
    dead_man: bool = False
    external_rate: float = BACKSTOP * EXTERNAL_RATE


class Mode(Enum):
    """Whether the hand is engaged."""

    WAITING = "waiting"
    ENGAGED = "engaged"
    FAULT = "fault"


# Bound once: to look a member up in its class takes a tenth of a microsecond, every period.
_WAITING: Final = Mode.WAITING
_ENGAGED: Final = Mode.ENGAGED
_FAULT: Final = Mode.FAULT
NOT_HELD: Final = "the switch of the device is not held"


@dataclass(init=False)
class SafetyState:
    """Memory of the safety layer.

    Fields:
        mode: WAITING at the start and after every fault; FAULT before that, until the user has
            acknowledged one that latches.
        scale: Share of the requested force that is given, 0 to 1.
        force: Given in the last period [N].
        quiet: Periods in a row in which the requested force was small.
        now: Time of the last period [s]; None before the first.
        fault: Why the hand was let go last; empty once it is engaged again.
        released: Force at the fault, while it is let go [N].
        left: Share of the release that is still to come, 1 to 0.
        own: Change that its own motion explains and `max_rate` held back [N].
        velocity: Velocity of the hand in the last period [m/s].
    """

    mode: Final[Mode]
    scale: Final[float]
    force: Final[Vec3]
    quiet: Final[int]
    now: Final[float | None]
    fault: Final[str]
    released: Final[Vec3]
    left: Final[float]
    own: Final[float]
    velocity: Final[Vec3]

    def __init__(
        self,
        mode: Mode = _WAITING,
        scale: float = 0.0,
        force: Vec3 = ZERO,
        quiet: int = 0,
        now: float | None = None,
        fault: str = "",
        released: Vec3 = ZERO,
        left: float = 0.0,
        own: float = 0.0,
        velocity: Vec3 = ZERO,
    ) -> None:
        self.mode = mode
        self.scale = scale
        self.force = force
        self.quiet = quiet
        self.now = now
        self.fault = fault
        self.released = released
        self.left = left
        self.own = own
        self.velocity = velocity


NEVER_ENGAGED: Final = SafetyState()


# Above 60 lines: half of them tell its arguments, and each call less is time in every period.
def guard(
    state: SafetyState,
    requested: Vec3,
    *,
    now: float,
    velocity: Vec3,
    silent: bool,
    limits: SafetyLimits,
    trouble: str = "",
    held: bool = True,
    own: float = math.inf,
    damping: float = 0.0,
) -> SafetyState:
    """The force that the device gets, as `force` of the next state.

    Args:
        state: After the last period.
        requested: Force of law, friction and damping [N].
        now: Time of this period [s].
        velocity: Velocity of the hand [m/s].
        silent: Whether the server has been silent for too long.
        limits: Limits of this hand.
        trouble: Fault that was found before the force was asked for; empty for none.
        held: Whether the user holds the device's switch.
        own: By how much the hand's way and speed in this period may change the force; inf to leave
            that out of account, for a law whose integral goes on while the hand rests [N].
        damping: By which its change of velocity may change the force [N s/m].
    """
    dt = 0.0 if state.now is None else now - state.now
    step = min(max(0.0, dt), 2.0 * limits.period)
    dropped = limits.dead_man and not held
    # A device that nobody holds may fall as fast as it likes.
    fault = "" if dropped else trouble or _fault(requested, velocity, dt, limits)
    if fault or dropped or state.left > 0.0:
        latched = state.mode is _FAULT or (limits.latch and fault != "")
        cause = fault or (NOT_HELD if dropped and not latched else "")
        return _release(state, cause, step, now, latched)
    size = norm(requested)
    quiet = state.quiet + 1 if size < limits.engage_below else 0
    engaged = state.mode is _ENGAGED or (
        state.mode is _WAITING and quiet >= limits.engage_periods and not silent
    )
    up = engaged and not silent
    time = limits.engage_time if up else limits.fade_time
    share = next_share(state.scale, up, min(size, limits.max_force), time, step)
    most = limits.max_rate * step
    own += state.own * (1.0 - step / FORGET_OWN)
    if damping > 0.0 and velocity != state.velocity:
        own += damping * norm(sub(velocity, state.velocity))
    if own > 2.0 * limits.max_force:
        own = 2.0 * limits.max_force
    held_back = own - most if own > most else 0.0
    most = min(most, own + limits.external_rate * step)
    force = limited(state.force, requested, share, limits.max_force, most)
    mode, cause = (_ENGAGED, "") if engaged else (state.mode, state.fault)
    return SafetyState(mode, share, force, quiet, now, cause, own=held_back, velocity=velocity)


def smooth(left: float) -> float:
    """Share of a force that is left when so much of its release is still to come, 1 to 0."""
    return left * left * (3.0 - 2.0 * left)


def rate_of(max_stiffness: float) -> float:
    """`max_rate` for a device, so that a hand that moves at `OWN_SPEED` meets its own force [N/s].

    A slower rate would delay the force that the hand itself causes.

    Args:
        max_stiffness: That the device renders stably [N/m].
    """
    return max(LEAST_RATE, OWN_SPEED * max_stiffness)


LEAST_RATE, OWN_SPEED = 1000.0, 0.5  # N/s; m/s, of a hand that taps


def next_share(share: float, up: bool, size: float, time: float, step: float) -> float:
    """Share of the law's force after one period of a fade, 0 to 1.

    Args:
        share: After the last period.
        up: Whether the force is to come, or to go.
        size: Size of the whole force [N]; a fade moves it no faster than `SAFETY_FADE_RATE`.
        time: Time of a whole fade [s].
        step: Time that counts of this period [s].
    """
    most = step / time
    if size > 0.0:
        most = min(most, SAFETY_FADE_RATE * step / size)
    return min(1.0, share + most) if up else max(0.0, share - most)


def limited(before: Vec3, requested: Vec3, share: float, max_force: float, most: float) -> Vec3:
    """The share of a force, clamped, that is given, no further from the last than allowed [N].

    Clamped first: force beyond the limit must not hold up a fade.

    Args:
        before: Given in the last period [N].
        requested: Force of law, friction and damping [N].
        share: Share of the clamped force, 0 to 1.
        max_force: Magnitude [N].
        most: Change in this period [N].
    """
    size = norm(requested)
    force = scale(requested, share * max_force / size if size > max_force else share)
    change = sub(force, before)
    jump = norm(change)
    return add(before, scale(change, most / jump)) if jump > most else force


def _release(state: SafetyState, fault: str, step: float, now: float, latched: bool) -> SafetyState:
    """Let a hand go after a fault: a smooth ramp from its last force to zero."""
    released, left = (state.released, state.left) if state.left > 0.0 else (state.force, 1.0)
    left = max(0.0, left - step / FAULT_RELEASE_TIME)
    return SafetyState(
        mode=_FAULT if latched else _WAITING,
        force=scale(released, smooth(left)),
        now=now,
        fault=fault or state.fault,
        released=released,
        left=left,
    )


def _fault(requested: Vec3, velocity: Vec3, dt: float, limits: SafetyLimits) -> str:
    """Why the hand must be let go; empty when it need not."""
    if not is_finite(requested):
        return f"the law asked for {requested} N"
    if not is_finite(velocity) or norm(velocity) > limits.max_speed:
        return f"the hand moved at {norm(velocity):.2f} m/s, above {limits.max_speed:g} m/s"
    if dt > limits.stall:
        return f"the loop stood still for {1e3 * dt:.0f} ms, above {1e3 * limits.stall:g} ms"
    return ""
