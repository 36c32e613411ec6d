"""The paper's proportional-integral local model, section 5, with the precautions of 5.1.

The law is L(z) = K_h + T I / (z - 1), eq. (12), on the surface as the simulation returned it, with
the gain K_h, the integral gain I and the haptic period T. The law integrates e - theta, the depth e
less the threshold theta of eq. (17) or (18); when contact ends, the integral's force goes to zero
linearly over a few simulation periods, if that is no faster than the limit below.

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

from typing import NamedTuple

# A probe that withdraws more slowly than this counts as at rest; otherwise tremor would switch
# between the two thresholds, and the integral would follow.
AT_REST_SPEED = 5e-3  # m/s


class Thresholds(NamedTuple):
    """Thresholds theta: steady-state depth errors that the integral tolerates, eqs. (17), (18).

    Eq. (17) is `entering == leaving` with `full_force` 0.

    Fields:
        entering: theta while the probe goes in or rests [m].
        leaving: Largest theta while the probe comes out [m].
        full_force: Integral's force from which on theta is `leaving`; below it theta is
            proportional to the force [N].
    """

    entering: float = 0.2e-3
    leaving: float = 1.0e-3
    full_force: float = 1.0


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
    moved_in: float,
    most: float,
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
        most: Largest change of the force that this displacement does not explain [N]; the integral
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
    least, largest = before + min(0.0, own) - most, before + max(0.0, own) + most
    force = min(max(state.force + grown, least - spring), largest - spring)
    force = min(max(force, 0.0), max_force)
    # Also a force that the integral took from a surface that left the hand goes to zero in time.
    ramp = max(0.0 if depth > 0.0 else state.ramp, force / release_time)
    return IntegralState(force, ramp, depth), spring + force
