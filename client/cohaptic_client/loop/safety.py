"""The safety layer: limits for any law, network or device, and what its four rules remember.

The rules are in `rules/guard.py`. A force that is not finite, a stalled loop or a hand that moves
too fast is a fault: the force falls to zero within `FAULT_RELEASE_TIME`, without a jerk, and
returns only after the hand has been out of the object. On a device with motors the user must also
acknowledge the fault, because a force that failed unseen must not return by itself. While the user
does not hold the device's switch, the force is taken away as after a fault, but no acknowledgement
is needed. The force fades while the server is silent, and rises again when patches return. The
force is clamped, and its rate is limited in both directions: a force that vanishes jolts the hand
as much as one that appears.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum
from typing import Final, NamedTuple

from cohaptic.status.reason import NO_NUMBER, STALLED, TOO_FAST
from cohaptic.vec import ZERO, Vec3, add, is_finite, norm, scale, sub

# s from a fault to no force; even 10 N fall no faster than `max_rate` allows
FAULT_RELEASE_TIME: Final = 0.02
# N/s; limit of all changes of the force that the hand's own motion does not cause: 0.02 N in a
# millisecond. A fingertip notices changes from about 0.05 N in 20 ms: reasoned, not measured. That
# the limit holds is shown by test_safety_attacks.py.
EXTERNAL_RATE: Final = 20.0
# N/s for fades of this layer: half of `EXTERNAL_RATE`, so that the surface keeps the other half and
# 10 N are gone in a second. Reasoned, not measured.
SAFETY_FADE_RATE: Final = 10.0
# Multiple of `external_rate` that this layer allows for all changes that the hand's own motion does
# not explain. The rules keep to the budget; the rest is for the rounding of their sum.
BACKSTOP: Final = 1.0 + 1e-9
# s; after it `max_rate` has passed the change that it held back: 30 N at 1 N/ms. What was held back
# for longer a server could use (tests/experiments/attacks/test_servers.py).
FORGET_OWN: Final = 0.03
# s; in a longer period the loop stood still. On a device with motors that is a fault already; the
# hand of a device that may stall for longer is simulated, or nobody's motor moves it. As
# `SafetyLimits.stall`, twenty periods at 1 kHz. Reasoned, not measured.
STOOD_STILL: Final = 0.02


@dataclass(frozen=True, slots=True)
class SafetyLimits:
    """Limits of the force on a hand.

    Args:
        max_force: Largest magnitude of the force [N].
        max_rate: Largest change of the force per second, up or down [N/s].
        max_speed: Largest speed of the hand [m/s].
        stall: Longest period; a longer one is a fault [s].
        silent_after: Time without a patch after which the server counts as silent [s].
        fade_time: Least time from full force to none when the server is silent; `SAFETY_FADE_RATE`
            may make it longer [s].
        engage_time: Least time from no force to full force, at the start and after a fault or
            silence [s].
        engage_below: Requested force below which the hand may be engaged [N].
        engage_periods: Number of successive periods in which the requested force must be below
            `engage_below` before the hand is engaged.
        period: Haptic period T; a late period changes the force by no more than two punctual
            periods would [s].
        stale: Largest age of a position that the device reports; it is added to the period when the
            tip's motion is compared with `max_speed` [s].
        latch: Whether the force stays off after a fault until the user acknowledges the fault.
        dead_man: Whether there is force only while the user holds the device's switch.
        external_rate: Largest change of the force per second that the hand's own motion does not
            explain [N/s].
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
    external_rate: float = EXTERNAL_RATE


class Mode(Enum):
    """State of the hand: it waits to be engaged, is engaged, or has a fault to acknowledge."""

    WAITING = "waiting"
    ENGAGED = "engaged"
    FAULT = "fault"


_WAITING: Final = Mode.WAITING  # bound once: to look a member up in its class is slow


class Trouble(NamedTuple):
    """A reason to take the force away.

    Fields:
        cause: One of the causes in `cohaptic.status.reason`; 0 for no trouble.
        words: The same with its numbers, for a person.
    """

    cause: int
    words: str


NO_TROUBLE: Final = Trouble(0, "")
NOT_HELD: Final = "the switch of the device is not held"


@dataclass(init=False)
class SafetyState:
    """Memory of the safety layer.

    Fields:
        mode: WAITING at the start and after a fault; FAULT while a fault that latches is not yet
            acknowledged; ENGAGED otherwise.
        scale: Fraction of the requested force that the device gets, 0 to 1.
        force: Force that the device got in the last period [N].
        quiet: Number of successive periods in which the requested force was below `engage_below`.
        now: Time of the last period [s]; None before the first.
        fault: Reason for the last release; empty once the hand is engaged again.
        cause: The same reason, as in `Trouble`; 0 once the hand is engaged again.
        released: Force at the time of the fault, from which the release starts [N].
        left: Remaining fraction of the release time, 1 to 0.
        own: Change of the force that the hand's own motion explains and `max_rate` has held back
            [N].
        velocity: Velocity of the hand in the last period [m/s].
        catch_up: Rate at which the force follows a motion during which the loop stood still [N/s];
            0 where there is none.
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
    catch_up: Final[float]
    cause: Final[int]

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
        catch_up: float = 0.0,
        cause: int = 0,
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
        self.catch_up = catch_up
        self.cause = cause


NEVER_ENGAGED: Final = SafetyState()


def smooth(left: float) -> float:
    """Return the remaining fraction of the force during a release: a smooth curve from 1 to 0.

    Args:
        left: Remaining fraction of the release time, 1 to 0.
    """
    return left * left * (3.0 - 2.0 * left)


def rate_of(max_stiffness: float) -> float:
    """Return `max_rate` for a device [N/s]: enough for the force that a hand at `OWN_SPEED` causes.

    A lower rate would delay that force.

    Args:
        max_stiffness: Largest stiffness that the device renders stably [N/m].
    """
    return max(LEAST_RATE, OWN_SPEED * max_stiffness)


# N/s; m/s, speed of a tapping hand. At that speed 2000 N/m, what the simulated device renders, make
# 1000 N/s. Reasoned, not measured.
LEAST_RATE, OWN_SPEED = 1000.0, 0.5


def next_fraction(
    fraction: float, up: bool, size: float, time: float, step: float, fade_limit: float = math.inf
) -> float:
    """Return the fraction of the requested force after one period of a fade, 0 to 1.

    Args:
        fraction: That fraction after the last period.
        up: Whether the force rises; False while it falls.
        size: Magnitude of the requested force [N]; a fade changes it no faster than
            `SAFETY_FADE_RATE`.
        time: Least duration of a whole fade [s].
        step: Time since the last period, capped at two periods [s].
        fade_limit: Largest change of the force, beside that rate [N].
    """
    limit = step / time
    if size > 0.0:
        limit = min(limit, min(SAFETY_FADE_RATE * step, fade_limit) / size)
    return min(1.0, fraction + limit) if up else max(0.0, fraction - limit)


def clamped(requested: Vec3, max_force: float) -> Vec3:
    """Return the requested force, or as much of it as a hand may get [N].

    Args:
        requested: Force of law, friction and damping [N].
        max_force: Largest magnitude of the force [N].
    """
    size = norm(requested)
    return scale(requested, max_force / size) if size > max_force else requested


def towards(before: Vec3, wanted: Vec3, limit: float) -> Vec3:
    """Return the wanted force, or the nearest to it within `limit` of the one before [N].

    Args:
        before: Force that the device got in the last period [N].
        limit: Largest change in this period [N].
    """
    change = sub(wanted, before)
    jump = norm(change)
    return add(before, scale(change, limit / jump)) if jump > limit else wanted


def released(
    state: SafetyState, fault: Trouble, step: float, now: float, latched: bool
) -> SafetyState:
    """Return the next state of a release, in which the force falls on a smooth ramp to zero.

    Args:
        fault: Reason for the release; `NO_TROUBLE` while it goes on.
        step: Time since the last period, capped at two periods [s].
        now: Time of this period [s].
        latched: Whether the user has to acknowledge it.
    """
    begun, left = (state.released, state.left) if state.left > 0.0 else (state.force, 1.0)
    left = max(0.0, left - step / FAULT_RELEASE_TIME)
    return SafetyState(
        mode=Mode.FAULT if latched else _WAITING,
        force=scale(begun, smooth(left)),
        now=now,
        fault=fault.words or state.fault,
        released=begun,
        left=left,
        cause=fault.cause or state.cause,
    )


def find_fault(requested: Vec3, velocity: Vec3, dt: float, limits: SafetyLimits) -> Trouble:
    """Return why the force must be released; `NO_TROUBLE` without a fault.

    Args:
        requested: Force of law, friction and damping [N].
        velocity: Velocity of the hand [m/s].
        dt: Time since the last period [s].
    """
    if not is_finite(requested):
        return Trouble(NO_NUMBER, f"the law asked for {requested} N")
    if not is_finite(velocity) or norm(velocity) > limits.max_speed:
        words = f"the hand moved at {norm(velocity):.2f} m/s, above {limits.max_speed:g} m/s"
        return Trouble(TOO_FAST, words)
    if dt > limits.stall:
        words = f"the loop stood still for {1e3 * dt:.0f} ms, above {1e3 * limits.stall:g} ms"
        return Trouble(STALLED, words)
    return NO_TROUBLE
