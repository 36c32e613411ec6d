"""Takes out the energy that the server's side makes; silent until some is made (science 3.4, 3.9).

A time-domain observer and controller (Hannaford and Ryu 2002), in two-port form under delay (Ryu
et al. 2010), for a predictive port. Whatever the loop does, in each period

    made = work on the hand + gain of the energy in the local spring - work of the body,

where the work of the body is own_force times the way of its surface: it moved against the force of
this client that it had then. For a spring whose surface rests the first two cancel; the remainder
was made or taken by delay, fades, changes of gain and law, and friction. It is zero at rest,
without delay, and for one user of the predictive law, whose surface only others move. That energy
is taken out by damping in contact, never more than is owed, never more than the device renders
stably, |B| < b - K T / 2 (Colgate), and never more than the contact's own force (as in Hunt and
Crossley 1975), so that it comes and goes with the contact.

The work uses the mean of the forces at both ends of a period: the energy that the hold of a force
over a period makes, K dx^2 / 2, is the device's, and Colgate's bound has paid for it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

FORGET: Final = 5.0  # s; time in which a resting hand dissipates by itself the energy it was given
SLOW: Final = 0.01  # m/s; a slower hand has little energy, and damping would only wait for it
RAMP: Final = 0.05  # s; from no damping to all of it
STEP_RATE: Final = 10.0  # N/s; by which a change of the damping may move the force
# N s/m; the campaign of `cohaptic experiment hands` is stable from 5 to 10
MAX_DAMPING: Final = 8.0


@dataclass(init=False)
class Passivity:
    """Memory of the layer.

    Fields:
        owed: Energy that was made and not taken out yet [J].
        damping: In use [N s/m].
        stored: In the local spring, as far as the hand has it [J].
    """

    owed: Final[float]
    damping: Final[float]
    stored: Final[float]

    def __init__(self, owed: float = 0.0, damping: float = 0.0, stored: float = 0.0) -> None:
        self.owed = owed
        self.damping = damping
        self.stored = stored


NOTHING_OWED: Final = Passivity()


def observe(owed: float, work: float, stored: float, from_body: float, dt: float) -> float:
    """Energy that is still to be taken out, after one period [J].

    Args:
        owed: After the last period, never negative [J].
        work: Work of the device on the hand in this period [J].
        stored: Gain of the energy in the local spring [J].
        from_body: Work of the body while its surface moved [J].
        dt: Time since the last period [s].
    """
    kept = max(0.0, 1.0 - dt / FORGET)
    return max(0.0, kept * owed + work + stored - from_body)


def given_share(stored: float, ratio: float, scale: float) -> float:
    """Energy of a spring whose force is given in part [J].

    A spring that is faded to `scale` stores that share. A force cut to a limit goes on storing as
    it is held: the area under it, f d - f^2 / (2 K).

    Args:
        stored: In the law's spring [J].
        ratio: Force that is given over the law's.
        scale: Share to which the safety layer has faded the law.
    """
    if scale <= 0.0:
        return 0.0
    ratio = min(ratio, scale)  # a force that still has to come down is not the spring's
    return stored * ratio * (2.0 - ratio / scale)


def dissipate(
    owed: float, damping: float, force: float, speed_in: float, dt: float, max_damping: float
) -> tuple[float, float]:
    """Damping of one period in contact; it comes and goes within `RAMP`, so the force has no steps.

    Args:
        owed: Energy to be taken out [J].
        damping: In the last period [N s/m].
        force: Normal force of the law [N].
        speed_in: Speed of the hand into the surface [m/s].
        dt: Time since the last period [s].
        max_damping: Limit, of the device and of this layer [N s/m].

    Returns:
        Damping [N s/m], and normal force on the hand, from none to twice the law's [N].
    """
    if force <= 0.0 or max_damping <= 0.0:
        return 0.0, force
    speed = max(SLOW, abs(speed_in))
    target = min(max_damping, owed / (speed * speed * dt)) if dt > 0.0 else 0.0
    change = min(max_damping * dt / RAMP, STEP_RATE * dt / speed)
    damping = min(max(target, damping - change), damping + change)
    # A hand that comes out is never pulled back in, and one that goes in meets no wall of air.
    return damping, force + min(force, max(-force, damping * speed_in))


def device_damping_limit(damping: float, stiffness: float, haptic_period: float) -> float:
    """Largest |B| that leaves a device passive, b > K T / 2 + |B| [N s/m].

    Args:
        damping: Physical, of the device, b [N s/m].
        stiffness: Rendered, K [N/m].
        haptic_period: T [s].
    """
    return min(MAX_DAMPING, max(0.0, damping - 0.5 * stiffness * haptic_period))
