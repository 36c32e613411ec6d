"""The paper's proportional-integral local model, section 5, with the precautions of 5.1.

The law is L(z) = K_h + T I / (z - 1), eq. (12), on the surface as the simulation returned it, with
the gain K_h, the integral gain I and the haptic period T. The law integrates e - theta, the depth e
less the threshold theta of eq. (17) or (18); when contact ends, the integral's force goes to zero
linearly over a few simulation periods, if that is no faster than the limit below. The server
chooses K_h as a fraction of the bound of the proportional law, and I as a fraction of the edge of
the stability area at the measured delay (science 3.1).

The paper has no limit for changes of the force that the hand does not cause. Here the integral
takes up what exceeds such a limit: it grows, falls and goes to zero no faster than the whole force
may change, and it gives way where the surface alone would change the force by more. The change of
the force then passes a saturation before it is summed up, so that nothing winds up, and for small
signals the saturation is a lower gain of the whole law, K_h and I alike. A loop that is stable at
all such gains cannot start to swing (science 3.1).

Eq. (18) as printed divides theta_2 by the integral's force I_tot; the paper's text says that theta
grows linearly to its set value, so the code uses theta_2 I_tot / I_full. As in the text, the small
threshold holds while the probe goes in (`entering`), the large one while it comes out (`leaving`).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache
from typing import Final, NamedTuple

from cohaptic.control.geometry import Sight
from cohaptic.control.laws.model import (
    DEFAULT_SETTINGS,
    Gains,
    LawSettings,
    LocalForce,
    LocalModel,
    Thresholds,
    coupled_stiffness,
    dented_depth,
    depth_alone,
)
from cohaptic.control.laws.proportional import proportional_stiffness

# A probe that withdraws more slowly than this counts as at rest; otherwise tremor would switch
# between the two thresholds, and the integral would follow: 0.1 mm at 8 Hz. Reasoned, not measured.
AT_REST_SPEED = 5e-3  # m/s
# Ratio of K_h to the coupled stiffness, and of I to the largest stable I. In the steady state the
# integral provides the force; a larger K_h improves little and oscillates more. Reasoned, not
# measured: `cohaptic experiment delay` shows what they come to.
PI_FRACTION_K: Final = 0.3
PI_FRACTION_I: Final = 0.3
# Simulation periods; for longer loops I is chosen as for this delay: 1 s at 60 Hz, and a polynomial
# of this degree takes some milliseconds. Reasoned, not measured.
LONGEST_DELAY: Final = 64


class IntegralState(NamedTuple):
    """State of the law's integral after one haptic period.

    Fields:
        force: Force of the integral [N].
        ramp: Rate at which that force falls to zero after contact [N/s].
        depth: Depth of the probe in the last period [m].
    """

    force: float = 0.0
    ramp: float = 0.0
    depth: float = 0.0


NO_INTEGRAL: Final = IntegralState()


class ProportionalIntegral(LocalModel):
    """Gain times depth below the dented surface, and an integral of that depth."""

    def __init__(self) -> None:
        super().__init__(answers_own_dent=True, integrates=True)

    def begin(self, force: float, gains: Gains, depth: float) -> object:
        """Return the integral that gives the force.

        From zero the integral would wind up while the law before still carries the contact.
        """
        return IntegralState(max(0.0, force - gains.k_h * depth), 0.0, depth)

    def held_to(self, memory: object, limit: float, gains: Gains) -> object:
        """Return the integral cut to what the spring leaves of the force.

        Where others take force from the hand behind the law, the integral would grow meanwhile.
        """
        if not isinstance(memory, IntegralState):
            return memory
        left = max(0.0, limit - gains.k_h * max(0.0, memory.depth))
        if memory.force <= left:
            return memory
        return IntegralState(left, memory.ramp, memory.depth)

    def force(
        self,
        memory: object,
        sight: Sight,
        gains: Gains,
        dt: float,
        settings: LawSettings = DEFAULT_SETTINGS,
        moved_in: float = 0.0,
        limit: float = math.inf,
    ) -> tuple[object, LocalForce]:
        """Compute the force of one period, eqs. (12), (17), (18)."""
        depth, k_h = dented_depth(sight), gains.k_h
        stored = 0.5 * k_h * depth * depth if depth > 0.0 else 0.0
        state, f = proportional_integral_step(
            memory if isinstance(memory, IntegralState) else NO_INTEGRAL,
            depth,
            k_h=k_h,
            integral_gain=gains.integral_gain,
            thresholds=settings.thresholds,
            release_time=settings.release_time,
            max_force=settings.max_force,
            dt=dt,
            moved_in=moved_in,
            limit=limit,
        )
        # Once the integral has settled, the surface follows the probe and the hand feels K_o.
        d_free = sight.depth
        stiffness = f / d_free if d_free > 0.0 else proportional_stiffness(k_h, sight.c_ii)
        return state, LocalForce(f, f - stiffness * depth_alone(sight), sight.c_ii * f, stored)

    def felt_stiffness(self, k_h: float, k_o: float) -> float:
        """Return the object's stiffness, to which the integral leads [N/m]."""
        return k_o

    def gains(
        self,
        row: Sequence[float],
        i: int,
        max_stiffness: float,
        loop_delay: float,
        simulation_period: float,
        alpha: float,
    ) -> Gains:
        """Choose K_h below the bound at any delay, and I below its edge at this delay."""
        # The integral, too, must stay within the stiffness that the device renders.
        coupled = min(coupled_stiffness(row), max_stiffness)
        k_h = PI_FRACTION_K * coupled
        # The client blends to a new patch over one period, which adds one period of delay.
        periods = min(LONGEST_DELAY, math.ceil(loop_delay / simulation_period - 1e-6) + 1)
        edge = largest_integral(k_h / coupled, periods)
        return Gains(k_h, PI_FRACTION_I * edge * coupled / simulation_period)


def integration_threshold(
    state: IntegralState,
    depth: float,
    entering: float,
    leaving: float,
    full_force: float,
    dt: float,
) -> float:
    """Return the threshold theta of eq. (17) or (18) [m]; 0 without contact.

    Args:
        state: State after the last period.
        depth: Depth of the probe now [m].
        entering: As in `Thresholds` [m].
        leaving: As in `Thresholds` [m].
        full_force: As in `Thresholds` [N].
        dt: Time since the last period [s].
    """
    if depth <= 0.0:
        return 0.0
    if depth >= state.depth - AT_REST_SPEED * dt:
        return entering
    fraction = 1.0 if state.force >= full_force else state.force / full_force
    return leaving * fraction


def proportional_integral_step(
    state: IntegralState,
    depth: float,
    k_h: float,
    integral_gain: float,
    thresholds: Thresholds,
    release_time: float,
    max_force: float,
    dt: float,
    moved_in: float,
    limit: float,
) -> tuple[IntegralState, float]:
    """Compute the force of the law L(z) = K_h + T I / (z - 1) in one period, eqs. (12), (17), (18).

    Args:
        state: State after the last period.
        depth: Depth e of the probe below the surface as the simulation returned it [m].
        k_h: Gain K_h [N/m].
        integral_gain: Integral gain I [N/(m s)].
        release_time: Time in which the integral's force falls to zero when contact ends [s].
        max_force: Upper limit of the integral's force [N].
        dt: Time since the last period [s].
        moved_in: Displacement of the hand into the surface since the last period [m].
        limit: Largest change of the force that this displacement does not explain [N]; the integral
            keeps it as long as its own force is above 0.

    Returns:
        State after this period, and force on the hand along the outward normal [N].
    """
    theta = integration_threshold(
        state, depth, thresholds.entering, thresholds.leaving, thresholds.full_force, dt
    )
    grown = integral_gain * dt * (depth - theta) if depth > 0.0 else -state.ramp * dt
    spring = k_h * max(0.0, depth)
    before, own = k_h * max(0.0, state.depth) + state.force, k_h * moved_in
    least, largest = before + min(0.0, own) - limit, before + max(0.0, own) + limit
    force = min(max(state.force + grown, least - spring), largest - spring)
    force = min(max(force, 0.0), max_force)
    # Also a force that the integral took from a surface that left the hand goes to zero in time.
    ramp = max(0.0 if depth > 0.0 else state.ramp, force / release_time)
    return IntegralState(force, ramp, depth), spring + force


def largest_integral(kappa: float, periods: int) -> float:
    """Return the largest stable integral gain, as I N T / K_o (edge of Fig. 8, with delay).

    Args:
        kappa: Ratio K_h / K_o of gain and stiffness; the function rounds it up to whole percent.
        periods: Loop delay in simulation periods N T; 1 is the paper's loop, without more delay.
    """
    return _edge(math.ceil(100.0 * kappa - 1e-9), max(1, periods))


@lru_cache(maxsize=4096)
def _edge(kappa_percent: int, periods: int) -> float:
    """Return the largest stable I N T / K_o for K_h / K_o [percent] and a loop of `periods` N T."""
    low, high = 0.0, 2.0
    while high - low > 1e-3 * high:
        middle = 0.5 * (low + high)
        stable = all_inside(characteristic(0.01 * kappa_percent, middle, periods))
        low, high = (middle, high) if stable else (low, middle)
    return low


def characteristic(kappa: float, integral: float, periods: int) -> list[float]:
    """Return the loop's characteristic polynomial in z, highest power first.

    With the force f = K_h e + I N T s and s the sum of the depths e, on a body that answers after n
    periods by e = -f / K_o, it is (z - 1)(z^n + K_h / K_o) + I N T / K_o.

    Args:
        kappa: Ratio K_h / K_o.
        integral: I N T / K_o.
        periods: Loop delay n in simulation periods, at least 1.
    """
    polynomial = [1.0, -1.0] + [0.0] * periods
    polynomial[periods] += kappa
    polynomial[periods + 1] += integral - kappa
    return polynomial


def all_inside(polynomial: list[float]) -> bool:
    """Return whether all roots lie within the unit circle, by the recursion of Schur and Cohn.

    Args:
        polynomial: Coefficients, highest power first, of which the first is not 0.
    """
    a = polynomial
    while len(a) > 1:
        k = a[-1] / a[0]
        if not abs(k) < 1.0:
            return False
        # The reversed polynomial times k takes the last coefficient away, and one degree with it.
        a = [x - k * y for x, y in zip(a[:-1], a[:0:-1], strict=True)]
    return True
