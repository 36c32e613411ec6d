"""The passivity layer: it damps out energy that the server's side generates (science 3.4, 3.9).

A time-domain observer and controller (Hannaford and Ryu 2002), in two-port form under delay (Ryu et
al. 2010), for a predictive port. The observer adds up in each period, whatever the loop does,

    generated = work on the hand + gain of the energy in the local spring - work of the body.

The local spring is the law's spring between the probe and the surface. The work of the body is
`own_force`, the force of this client that the body carried, times the displacement of the body's
surface against that force. While the surface rests, the first two terms cancel; the remainder is
energy that delay, fades, changes of gain and law, and friction generate or take. The remainder is
zero at rest, without delay, and for a single user of the predictive law, because only other users
move that user's surface. Damping in contact takes the energy out. The damping takes out no more
energy than has been generated; it is no larger than the device renders stably, |B| < b - K T / 2
(Colgate, see `device_damping_limit`); and its force is no larger than the contact's own force (as
in Hunt and Crossley 1975), so that it comes and goes with the contact.

The work uses the mean of the forces at both ends of a period. A real device holds the force
constant over a period, which generates the energy K dx^2 / 2 for a motion dx in a spring of
stiffness K; Colgate's bound already accounts for that energy.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

# s; time in which a resting hand dissipates the energy by itself. With 5 s one room less of 20,000
# kept a swing than with 1 s (`cohaptic experiment hands`, in an earlier version).
FORGET: Final = 5.0
# m/s; a slower hand has little energy (5 uJ of 0.1 kg), and damping would take it out too slowly:
# 8 N s/m are 0.08 N then. Reasoned, not measured.
SLOW: Final = 0.01
# s; from no damping to full damping: half a swing of a light hand at 10 Hz, so that the damping is
# there within the swing that it is for, and comes without a step. Reasoned, not measured.
RAMP: Final = 0.05
# N/s; limit of the change of force by a change of the damping: half of `EXTERNAL_RATE`, as for the
# laws. Reasoned, not measured.
STEP_RATE: Final = 10.0
# N s/m; the campaign of `cohaptic experiment hands` is stable from 5 to 10
MAX_DAMPING: Final = 8.0


@dataclass(init=False)
class Passivity:
    """Memory of the passivity layer.

    Fields:
        owed: Energy that was generated and has not been damped out yet [J].
        damping: Damping in use [N s/m].
        stored: Energy in the local spring, counted for the force that the hand is given [J].
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
    """Return the generated energy that has not been damped out yet, after one more period [J].

    Args:
        owed: The same energy after the last period, never negative [J].
        work: Work of the device on the hand in this period [J].
        stored: Gain of the energy in the local spring in this period [J].
        from_body: Work of the body in this period, while its surface moved [J].
        dt: Time since the last period [s].
    """
    kept = max(0.0, 1.0 - dt / FORGET)
    return max(0.0, kept * owed + work + stored - from_body)


def given_energy(stored: float, ratio: float, scale: float) -> float:
    """Return the energy that the law's spring stores for the force that reaches the hand [J].

    A spring whose force is faded to the fraction `scale` stores that fraction of its energy. If a
    spring of stiffness K is pressed to the depth d and its force is cut to f, the stored energy is
    the area under the cut force, f d - f^2 / (2 K).

    Args:
        stored: Energy in the law's spring at its full force [J].
        ratio: Force given to the hand, divided by the law's force.
        scale: Fraction to which the safety layer has faded the law's force.
    """
    if scale <= 0.0:
        return 0.0
    ratio = min(ratio, scale)  # force above the faded law's, still falling, is not the spring's
    return stored * ratio * (2.0 - ratio / scale)


def dissipate(
    owed: float,
    damping: float,
    force: float,
    speed_in: float,
    dt: float,
    max_damping: float,
    limit: float = math.inf,
) -> tuple[float, float]:
    """Compute the damping and the damped normal force for one period in contact.

    The damping rises and falls no faster than `RAMP` and `STEP_RATE` allow, so the force has no
    steps.

    Args:
        owed: Generated energy that is to be damped out [J].
        damping: Damping in the last period [N s/m].
        force: Normal force of the law [N].
        speed_in: Speed of the hand into the surface [m/s].
        dt: Time since the last period [s].
        max_damping: Largest damping that both the device and this layer allow [N s/m].
        limit: Largest change of the damping, beside `RAMP` and `STEP_RATE` [N s/m].

    Returns:
        Damping [N s/m], and normal force on the hand, from zero to twice the law's force [N].
    """
    if force <= 0.0 or max_damping <= 0.0:
        return 0.0, force
    speed = max(SLOW, abs(speed_in))
    target = min(max_damping, owed / (speed * speed * dt)) if dt > 0.0 else 0.0
    change = min(max_damping * dt / RAMP, STEP_RATE * dt / speed, limit)
    damping = min(max(target, damping - change), damping + change)
    # Damping never pulls a leaving hand back in, and never stops an entering hand like a wall.
    return damping, force + min(force, max(-force, damping * speed_in))


def device_damping_limit(damping: float, stiffness: float, haptic_period: float) -> float:
    """Return the largest damping |B| up to `MAX_DAMPING` that a device renders passively [N s/m].

    Colgate's bound is b > K T / 2 + |B|.

    Args:
        damping: Physical damping b of the device [N s/m].
        stiffness: Rendered stiffness K [N/m].
        haptic_period: Haptic period T [s].
    """
    return min(MAX_DAMPING, max(0.0, damping - 0.5 * stiffness * haptic_period))
