"""Takes out the energy that delay makes; silent until some is made (science 3.4).

A time-domain observer and controller (Hannaford and Ryu 2002), in two-port form under delay (Ryu
et al. 2010), for a predictive port. Between its patches the client's local spring is passive by
itself, so energy can only come in where the surface moves under the force. The body did that
movement against `own_force`, the force of this client that it had then; the hand meets it with the
force of now. The difference,

    (f - own_force) dx,

with dx the movement towards the hand of the surface that the law presses on, is what the network
made: nothing at rest, nothing without delay, and nothing for one user of the predictive law, whose
surface only others move. What was made is taken out by damping in contact, never more than is owed,
never more than the device renders stably: |B| < b - K T / 2 (Colgate).
"""

from __future__ import annotations

from typing import NamedTuple

FORGET = 5.0  # s; a hand that rested so long has swallowed by itself what it was given
SLOW = 0.01  # m/s; a slower hand has little energy, and damping would only wait for it
RAMP = 0.05  # s; from no damping to all of it
MAX_DAMPING = 8.0  # N s/m; the campaign of `cohaptic experiment hands` is stable from 5 to 10


class Passivity(NamedTuple):
    """Memory of the layer.

    Fields:
        owed: Energy that was made and not taken out yet [J].
        damping: In use [N s/m].
    """

    owed: float = 0.0
    damping: float = 0.0


def observe(owed: float, force: float, own_force: float, surface_moved: float, dt: float) -> float:
    """Energy that is still to be taken out, after one period [J].

    Args:
        owed: After the last period, never negative [J].
        force: Normal force of the law now [N].
        own_force: Of this client in the surface that is shown [N].
        surface_moved: By how much it came towards the hand in this period [m].
        dt: Time since the last period [s].
    """
    kept = max(0.0, 1.0 - dt / FORGET)
    return max(0.0, kept * owed + (force - own_force) * surface_moved)


def dissipate(
    owed: float, damping: float, force: float, speed_in: float, dt: float, max_damping: float
) -> tuple[float, float, float]:
    """Damping of one period in contact; it comes and goes within `RAMP`, so the force has no steps.

    Args:
        owed: Energy to be taken out [J].
        damping: In the last period [N s/m].
        force: Normal force of the law [N].
        speed_in: Of the hand into the surface [m/s].
        dt: Time since the last period [s].
        max_damping: Limit, of the device and of this layer [N s/m].

    Returns:
        Energy that is left [J], damping [N s/m], and normal force on the hand [N].
    """
    if force <= 0.0 or max_damping <= 0.0:
        return owed, 0.0, force
    speed = max(SLOW, abs(speed_in))
    wanted = min(max_damping, owed / (speed * speed * dt)) if dt > 0.0 else 0.0
    change = max_damping * dt / RAMP
    damping = min(max(wanted, damping - change), damping + change)
    # A hand that comes out is never pulled back in.
    damped = max(0.0, force + damping * speed_in)
    return max(0.0, owed - (damped - force) * speed_in * dt), damping, damped


def device_damping_limit(damping: float, stiffness: float, haptic_period: float) -> float:
    """Largest |B| that leaves a device passive, b > K T / 2 + |B| [N s/m].

    Args:
        damping: Physical, of the device, b [N s/m].
        stiffness: Rendered, K [N/m].
        haptic_period: T [s].
    """
    return min(MAX_DAMPING, max(0.0, damping - 0.5 * stiffness * haptic_period))
