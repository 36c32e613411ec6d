"""The predictive local model, science 3.3, with the integral that restores what its cap takes.

The server sends the surface free of this client's own force; the client solves its own contact at
the haptic rate. Nothing of its own force comes back late, so alone it is exact at any delay.

Where the gain must stay below 1 / C_ii for the others' sake, the integral of x_h - x_o, with x_o as
the own force makes it here and now, brings the force slowly to what it should be: from f = K d to
f = d / C_ii, as the lead-lag (K s + I) / (s + I C_ii). Only its speed depends on the delay.
"""

from __future__ import annotations

# The integral is given up as the hand leaves: the force stays below this many times d / C_ii, so it
# ends where the contact ends, without a step.
RELEASE_SLOPE = 2.0


def predictive_step(
    integral: float,
    depth_free: float,
    k_h: float,
    integral_gain: float,
    c_ii: float,
    dt: float,
) -> tuple[float, float]:
    """One period: force f = K (x_h - x_free) + integral.

    Args:
        integral: Force of the integral after the last period [N].
        depth_free: Of the probe below the surface free of its own force [m].
        k_h: Gain K_i [N/m]; exact at 1 / C_ii, capped by `gains.choose_gains`.
        integral_gain: I [N/(m s)]; 0 for none.
        c_ii: Compliance of the contact [m/N].
        dt: Time since the last period [s].

    Returns:
        Integral, and force on the hand along the outward normal [N].
    """
    if depth_free <= 0.0:
        return 0.0, 0.0
    # x_h - x_o = depth - C_ii (K depth + integral); the integral's own part taken implicitly.
    error = depth_free * (1.0 - c_ii * k_h)
    gain = integral_gain * dt
    integral = (integral + gain * error) / (1.0 + gain * c_ii)
    most = max(0.0, (RELEASE_SLOPE / c_ii - k_h) * depth_free)
    integral = min(max(integral, 0.0), most)
    return integral, k_h * depth_free + integral
