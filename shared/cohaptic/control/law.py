"""The local models (laws) that a client may run, and the function that runs them.

A law maps the surface as evaluated at the probe to the normal force on the hand; the state of the
law's integral is an argument and a result. A law limits only the integral's force: the client's
`safety.py` limits the whole force, as the last step.

The predictive law (science 3.3 and 3.8): the server sends the free surface, without the dent of
this client's own force, and the client solves its own contact at the haptic rate. The client's own
force is not part of the delayed loop, so the force on a single hand is exact at any delay. The gain
is the object's own stiffness, K_i = 1 / C_ii, or the device's limit if that is less; no integral
makes up for that limit, since such an integral generates energy (3.8).

The paper's proportional law (section 3): the law presses on the surface as the simulation returned
it, including the client's own dent, so the client's own force returns one round trip late. A single
hand is stable iff its gain k_h is below the object's stiffness k_o, eq. (8), at every delay
(science 3.1); several hands with the compliance matrix C are stable under any delay iff the
spectral radius rho(|C| diag(k_h)) is below 1 (3.2).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum
from typing import Final, NamedTuple, assert_never

from cohaptic.control.geometry import Sight
from cohaptic.control.proportional_integral import (
    IntegralState,
    Thresholds,
    proportional_integral_step,
)
from cohaptic.vec import dot


class Law(Enum):
    """A local model; the order of the members is that of their numbers on the wire.

    Code that treats laws differently should test one of these attributes, not a law's name.

    Attributes:
        answers_own_dent: Whether the law presses on the surface that includes the dent of its own
            force. That force then returns one round trip late, which bounds the gain and the
            influence of other users (science 3.1, 3.2). Any other law renders the object's own
            stiffness at any delay (3.3), and the room's lag bounds the influence of others (3.8).
        integrates: Whether the law has an integral, whose force changes even while the hand rests.
    """

    PROPORTIONAL = "proportional"
    PI = "pi"
    PREDICTIVE = "predictive"

    answers_own_dent: bool
    integrates: bool


# Attributes are quicker than methods, and they are read every period and for every user every tick.
# A law that integrates answers its own dent; all code that treats integrals assumes this.
_PROPERTIES = {
    Law.PROPORTIONAL: (True, False),
    Law.PI: (True, True),
    Law.PREDICTIVE: (False, False),
}
for _law in Law:
    _law.answers_own_dent, _law.integrates = _PROPERTIES[_law]

DEFAULT_LAW: Final = Law.PREDICTIVE
# Bound once: looking a member up in its class is slow, and this happens every period.
_PREDICTIVE: Final = Law.PREDICTIVE
_PROPORTIONAL: Final = Law.PROPORTIONAL
_PI: Final = Law.PI


@dataclass(init=False)
class Gains:
    """Gains that the server chose for a client's law (`gains.choose_gains`).

    Fields:
        k_h: Gain K_h, the law's stiffness [N/m].
        integral_gain: Integral gain I; 0 for a law without an integral [N/(m s)].
    """

    k_h: Final[float]
    integral_gain: Final[float]

    def __init__(self, k_h: float, integral_gain: float = 0.0) -> None:
        self.k_h = k_h
        self.integral_gain = integral_gain


class LawSettings(NamedTuple):
    """Settings of a law's integral.

    Fields:
        thresholds: Depth errors up to which the integral does not grow, eqs. (17) and (18).
        release_time: Time in which the integral's force falls to zero when contact ends, a few
            simulation periods (section 5.1) [s].
        max_force: Upper limit of the integral's force [N].
    """

    thresholds: Thresholds = Thresholds()
    release_time: float = 0.1
    max_force: float = 10.0


@dataclass(init=False)
class LocalForce:
    """The result of a law for one haptic period.

    Fields:
        normal_force: Force f on the hand along the surface's normal, never negative [N].
        felt_from_others: Part of `normal_force` that the other users' contacts cause [N].
        indentation: Dent that the force makes under the probe, C_ii f [m].
        stored: Energy in the law's spring; an integral's force stores no energy [J].
    """

    normal_force: Final[float]
    felt_from_others: Final[float]
    indentation: Final[float]
    stored: Final[float]

    def __init__(
        self, normal_force: float, felt_from_others: float, indentation: float, stored: float
    ) -> None:
        self.normal_force = normal_force
        self.felt_from_others = felt_from_others
        self.indentation = indentation
        self.stored = stored


NO_FORCE: Final = LocalForce(0.0, 0.0, 0.0, 0.0)
AT_REST = IntegralState()
_DEFAULT = LawSettings()


def pressed_depth(law: Law, sight: Sight) -> float:
    """Return the depth of the probe below the surface on which a law presses [m].

    The predictive law presses on the free surface, and the paper's laws on the surface as the
    simulation returned it, which includes the own dent.
    """
    if not law.answers_own_dent:
        return sight.depth
    return sight.depth - sight.c_ii * dot(sight.own_force, sight.normal)


def local_force(
    law: Law,
    memory: IntegralState,
    sight: Sight,
    gains: Gains,
    dt: float,
    settings: LawSettings = _DEFAULT,
    moved_in: float = 0.0,
    most: float = math.inf,
) -> tuple[IntegralState, LocalForce]:
    """Compute the force of a law in one period, from the free surface at the probe.

    Args:
        memory: State of the law's integral after the last period; `AT_REST` before the first.
        sight: Free surface as evaluated at the probe.
        dt: Time since the last period [s].
        settings: Settings of the integral.
        moved_in: Displacement of the hand into the surface since the last period [m].
        most: Largest change of the force that an integral may make or leave to the surface in this
            period, beyond the change that `moved_in` explains [N].

    Returns:
        State of the integral after this period, and the force.
    """
    d_free = sight.depth
    # Depth that the probe would have below the surface if no other user touched the body.
    d_alone = max(0.0, d_free - dot(sight.u_others, sight.normal))
    if law is _PREDICTIVE:
        f = predictive_force(d_free, gains.k_h)
        stored = 0.5 * f * d_free
        return memory, LocalForce(f, f - gains.k_h * d_alone, sight.c_ii * f, stored)
    d = pressed_depth(law, sight)
    stored = 0.5 * gains.k_h * d * d if d > 0.0 else 0.0
    stiffness = proportional_stiffness(k_h=gains.k_h, c_ii=sight.c_ii)
    if law is _PROPORTIONAL:
        f = proportional_force(d, k_h=gains.k_h)
    elif law is not _PI:
        raise ValueError(f"no force is known for {law}")
    else:
        memory, f = proportional_integral_step(
            memory,
            d,
            k_h=gains.k_h,
            integral_gain=gains.integral_gain,
            thresholds=settings.thresholds,
            release_time=settings.release_time,
            max_force=settings.max_force,
            dt=dt,
            moved_in=moved_in,
            most=most,
        )
        # Once the integral has settled, the surface follows the probe and the hand feels K_o.
        stiffness = f / d_free if d_free > 0.0 else stiffness
    return memory, LocalForce(f, f - stiffness * d_alone, sight.c_ii * f, stored)


def predictive_force(depth_free: float, k_h: float) -> float:
    """Return the normal force of the predictive law, the gain times the depth; 0 outside [N].

    Args:
        depth_free: Depth of the probe below the hand's free surface, x_h - x_free [m].
        k_h: Gain K_i, at most the object's own stiffness 1 / C_ii [N/m].

    Returns:
        Force on the hand along the outward normal [N].
    """
    return k_h * depth_free if depth_free > 0.0 else 0.0


def proportional_force(depth: float, k_h: float) -> float:
    """Return the normal force of the proportional law, the gain times the depth; 0 outside [N].

    Args:
        depth: Depth of the probe below the surface as the simulation returned it, x_h - x_o [m].
        k_h: Gain K_h [N/m]; a single hand is stable iff k_h < 1 / C_ii, eq. (8).

    Returns:
        Force on the hand along the outward normal [N].
    """
    return k_h * depth if depth > 0.0 else 0.0


def felt_stiffness(law: Law, k_h: float, k_o: float) -> float:
    """Return the stiffness that a single hand feels in the steady state [N/m].

    Args:
        k_h: Gain of the law [N/m].
        k_o: Stiffness of the object at the contact, 1 / C_ii [N/m].
    """
    if law is _PREDICTIVE:
        return min(k_h, k_o)
    if law is _PROPORTIONAL:
        return k_h * k_o / (k_h + k_o)  # eq. (11)
    if law is _PI:
        return k_o
    assert_never(law)


def proportional_stiffness(k_h: float, c_ii: float) -> float:
    """Return the stiffness that a hand with the proportional law feels in the steady state [N/m].

    If the probe is x_h deep, the surface yields to x_o = K_h x_h / (K_h + K_o), eq. (11), and the
    force is K_h (x_h - x_o) = K_h K_o x_h / (K_h + K_o).

    Args:
        k_h: Gain K_h [N/m].
        c_ii: Compliance of the contact, 1 / K_o [m/N].
    """
    return k_h / (1.0 + k_h * c_ii)
