"""The paper's proportional-integral local model, section 5, with the precautions of 5.1.

The law is L(z) = K_h + T I / (z - 1), eq. (12), on the surface as the simulation returned it. The
law integrates e - theta, the depth e less the threshold theta of eq. (17) or (18); when contact
ends, the integral's force goes to zero linearly over a few simulation periods.

Eq. (18) as printed divides theta_2 by I_tot; the paper's text says that theta grows linearly to its
set value, so the code uses theta_2 I_tot / I_full. The text uses the small threshold on the way in
and the large one on the way out: `entering` and `leaving`.
"""

from __future__ import annotations

from typing import NamedTuple

# A probe that withdraws more slowly than this counts as at rest; otherwise tremor would switch
# between the two thresholds, and the integral would follow.
AT_REST_SPEED = 5e-3  # m/s


class Thresholds(NamedTuple):
    """Steady-state error that the integral tolerates, eqs. (17) and (18).

    Eq. (17) is `entering == leaving` with `full_force` 0.

    Fields:
        entering: theta while the probe goes in or rests [m].
        leaving: Largest theta while the probe comes out [m].
        full_force: Force of the integral from which `leaving` holds in full; below it theta is
            proportional to that force [N].
    """

    entering: float = 0.2e-3
    leaving: float = 1.0e-3
    full_force: float = 1.0


class IntegralState(NamedTuple):
    """State of the integral, kept from one period to the next.

    Fields:
        force: Force of the integral [N].
        ramp: Rate at which that force falls to zero after contact [N/s].
        depth: Depth of the probe in the last period [m].
    """

    force: float = 0.0
    ramp: float = 0.0
    depth: float = 0.0


def integration_threshold(
    state: IntegralState,
    depth: float,
    entering: float,
    leaving: float,
    full_force: float,
    dt: float,
) -> float:
    """Threshold theta of eq. (17) or (18) [m]; the fields of `Thresholds` are separate arguments.

    Args:
        state: State after the last period.
        depth: Depth of the probe now [m].
        entering: Threshold on the way in and at rest [m].
        leaving: Largest threshold on the way out [m].
        full_force: Force of the integral from which `leaving` holds in full [N].
        dt: Time since the last period [s].
    """
    if depth <= 0.0:
        return 0.0
    if depth >= state.depth - AT_REST_SPEED * dt:
        return entering
    share = 1.0 if state.force >= full_force else state.force / full_force
    return leaving * share


def proportional_integral_step(
    state: IntegralState,
    depth: float,
    k_h: float,
    integral_gain: float,
    thresholds: Thresholds,
    release_time: float,
    max_force: float,
    dt: float,
) -> tuple[IntegralState, float]:
    """Force of the law L(z) = K_h + T I / (z - 1) in one period, eqs. (12), (17), (18).

    Args:
        state: State after the last period.
        depth: e, depth of the probe below the surface as the simulation returned it [m].
        k_h: Gain [N/m].
        integral_gain: I [N/(m s)].
        release_time: Time in which the integral's force falls to zero when contact ends [s].
        max_force: Upper limit of the integral's force [N].
        dt: Time since the last period [s].

    Returns:
        State after this period, and force on the hand along the outward normal [N].
    """
    if depth <= 0.0:
        force = max(0.0, state.force - state.ramp * dt)
        return IntegralState(force, state.ramp, depth), force
    theta = integration_threshold(
        state, depth, thresholds.entering, thresholds.leaving, thresholds.full_force, dt
    )
    force = state.force + integral_gain * dt * (depth - theta)
    force = min(max(force, 0.0), max_force)
    return IntegralState(force, force / release_time, depth), k_h * depth + force
