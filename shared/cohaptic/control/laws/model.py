"""A local model (law): what the loop, the server and `cohaptic stability` ask it.

A law maps the surface as evaluated at the probe to the normal force on the hand; its memory is an
argument and a result. A law limits only the force of an integral: the loop's guard limits the whole
force, as the last step.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple

from cohaptic.control.geometry import Sight
from cohaptic.vec import dot


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


DEFAULT_SETTINGS: Final = LawSettings()


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


class LocalModel:
    """A law. A memory is what the law returned in the last period; None before the first.

    Fields:
        answers_own_dent: Whether the law presses on the surface that includes the dent of its own
            force. That force then returns one round trip late, which bounds the gain and the
            influence of other users (science 3.1, 3.2). Any other law renders the object's own
            stiffness at any delay (3.3), and the room's lag bounds the influence of others (3.8).
        integrates: Whether the law has an integral, whose force changes even while the hand rests.
            Such a law answers its own dent; all code that treats integrals assumes this.
    """

    answers_own_dent: Final[bool]
    integrates: Final[bool]

    def __init__(self, answers_own_dent: bool, integrates: bool) -> None:
        self.answers_own_dent = answers_own_dent
        self.integrates = integrates

    def begin(self, force: float, gains: Gains, depth: float) -> object:
        """Return the memory in which the law gives a force, as another law did before it.

        Args:
            force: Normal force [N].
            depth: Depth on which the law presses, as `pressed_depth` returns it [m].
        """
        return None

    def held_to(self, memory: object, limit: float, gains: Gains) -> object:
        """Return a memory with which the law's force does not exceed `limit`.

        A law without a memory returns the memory unchanged.

        Args:
            memory: Memory after the last period.
            limit: Largest normal force [N].
            gains: Gains of the law.
        """
        return memory

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
        """Compute the force in one period, from the free surface at the probe.

        Args:
            sight: Free surface as evaluated at the probe.
            dt: Time since the last period [s].
            settings: Settings of the integral.
            moved_in: Displacement of the hand into the surface since the last period [m].
            limit: Largest change of the force that an integral may make or leave to the surface in
                this period, beyond the change that `moved_in` explains [N].

        Returns:
            Memory after this period, and the force.
        """
        raise NotImplementedError

    def felt_stiffness(self, k_h: float, k_o: float) -> float:
        """Return the stiffness that a single hand feels in the steady state [N/m].

        Args:
            k_h: Gain of the law [N/m].
            k_o: Stiffness of the object at the contact, 1 / C_ii [N/m].
        """
        raise NotImplementedError

    def gains(
        self,
        row: Sequence[float],
        i: int,
        max_stiffness: float,
        loop_delay: float,
        simulation_period: float,
        alpha: float,
    ) -> Gains:
        """Choose the gains of client i; the arguments are as in `gains.choose_gains`."""
        raise NotImplementedError


def depth_alone(sight: Sight) -> float:
    """Return the depth that the probe would have if no other user touched the body [m]."""
    depth = sight.depth - dot(sight.u_others, sight.normal)
    return depth if depth > 0.0 else 0.0


def dented_depth(sight: Sight) -> float:
    """Return the depth below the surface as the simulation returned it, with the own dent [m]."""
    return sight.depth - sight.c_ii * dot(sight.own_force, sight.normal)


def coupled_stiffness(row: Sequence[float]) -> float:
    """Return the coupling-aware stiffness 1 / sum_j |C_ij| of contact i (science 3.2) [N/m].

    Args:
        row: Row i of the compliance matrix C of all contacts, C_ii included [m/N].
    """
    return 1.0 / sum(abs(c) for c in row)
