"""The local models that a client may run, and the one function that runs them.

A law maps the surface as evaluated at the probe to the normal force on the hand; its memory is an
argument and a result. It applies no limits: the client's `safety.py` does, once and last.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import Final, NamedTuple

from cohaptic.control.geometry import Sight
from cohaptic.control.predictive import predictive_force
from cohaptic.control.proportional import proportional_force, proportional_stiffness
from cohaptic.control.proportional_integral import (
    IntegralState,
    Thresholds,
    proportional_integral_step,
)
from cohaptic.vec import dot


class Law(Enum):
    """Name of a local model."""

    PROPORTIONAL = "proportional"
    PI = "pi"
    PREDICTIVE = "predictive"


# Bound once: to look a member up in its class is slow, and this is done every period.
_PREDICTIVE: Final = Law.PREDICTIVE
_PROPORTIONAL: Final = Law.PROPORTIONAL


@dataclass(init=False)
class Gains:
    """Gains that the server chose for a client's law (`gains.choose_gains`).

    Fields:
        k_h: K_h [N/m].
        integral_gain: I of the law's integral; 0 for none [N/(m s)].
    """

    k_h: Final[float]
    integral_gain: Final[float]

    def __init__(self, k_h: float, integral_gain: float = 0.0) -> None:
        self.k_h = k_h
        self.integral_gain = integral_gain


class LawSettings(NamedTuple):
    """Settings of the integral of `Law.PI`.

    Fields:
        thresholds: Eqs. (17), (18).
        release_time: From full force to none when contact ends: a few N T (section 5.1) [s].
        max_force: The integral stays below it [N].
    """

    thresholds: Thresholds = Thresholds()
    release_time: float = 0.1
    max_force: float = 10.0


@dataclass(init=False)
class LocalForce:
    """The force of a law in one period.

    Fields:
        normal_force: On the hand along the surface's normal, never negative [N].
        felt_from_others: Its part that is caused by the other users' contacts [N].
        indentation: Of the surface under the probe, own force included [m].
        stored: Energy in the law's spring; the force of an integral stores none [J].
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
    """Depth of the probe below the surface that a law presses on [m].

    The paper's laws press on the surface as the simulation returned it, own dent included.
    """
    if law is _PREDICTIVE:
        return sight.depth
    return sight.depth - sight.c_ii * dot(sight.own_force, sight.normal)


def local_force(
    law: Law,
    memory: IntegralState,
    sight: Sight,
    gains: Gains,
    dt: float,
    settings: LawSettings = _DEFAULT,
) -> tuple[IntegralState, LocalForce]:
    """Force of `law` for a probe at a local surface.

    Args:
        law: Local model.
        memory: Of its integral, after the last period; `AT_REST` before the first.
        sight: Of the surface free of this client's own force.
        gains: Of the law.
        dt: Time since the last period [s].
        settings: Of the integral.

    Returns:
        Memory after this period, and the force.
    """
    d_free = sight.depth
    # Depth of the probe below the surface if nobody else touched the body.
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
        )
        # Once the integral has settled the surface follows the probe: K_o is felt.
        stiffness = f / d_free if d_free > 0.0 else stiffness
    return memory, LocalForce(f, f - stiffness * d_alone, sight.c_ii * f, stored)
