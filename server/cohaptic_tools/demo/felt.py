"""Defines when two hands feel each other, and predicts it from the compliance of their places.

The first hand presses to a depth d, the second one rests at half of it, and each is a spring of
compliance h. On a linear body with the compliance C between the two places their forces solve

    (C + h 1) f = d (1, 1/2),    f >= 0,

and each hand feels of the other the part f_i - max(0, (C f)_i / C_ii) of its force, since (C f)_i
is the depth of its tip below the resting surface. Both are in proportion to d.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cohaptic.simulated.hand import Hand
from cohaptic_server.numeric import Floats

# Forces with which hands press in a demonstration: enough to be noticed, and half of what the
# device of a simulated hand can render.
LEAST_PRESS, MAX_PRESS = 0.5, 5.0  # N
# Least part of its force that a hand feels of the other: four times the smallest change that it
# perceives (`lateness.LEAST`).
FELT = 0.2  # N
# Stiffness up to which the device of a simulated hand renders a place as it is; what is stiffer
# feels softer, and its force is not that of the equilibrium.
RENDERED = 2000.0  # N/m
_MARGIN = 1.5  # of a prediction: contacts slide, and rubber gives way
_HARDLY = 0.95  # share of `MAX_PRESS` that is predicted at most


class PairForces(NamedTuple):
    """Forces of two hands, for one or many pairs of places.

    Args:
        force: Force on the first hand and on the second, shape (2, ...) [N]; for a unit depth of
            the first hand, [N/m].
        felt: Part of each force that is due to the other hand, without its sign, as `force`.
    """

    force: Floats
    felt: Floats

    @property
    def enough(self) -> Floats:
        """Forces over the least ones, the smallest of all four, shape (...); 1 is just felt."""
        return np.asarray(np.minimum(self.force / LEAST_PRESS, self.felt / FELT).min(axis=0))

    @property
    def is_felt(self) -> bool:
        """Whether both hands of one pair press with a force in the range and feel each other."""
        return bool(self.enough >= 1.0 and self.force.max() <= MAX_PRESS)


def expected(first: Floats, between: Floats, second: Floats) -> PairForces:
    """Predict the forces of pairs of hands per metre of the first hand's depth.

    Args:
        first: Compliance C_11 of the first hand's place, shape (...) [m/N].
        between: Compliance C_12 between both places, shape (...) [m/N].
        second: Compliance C_22 of the second hand's place, shape (...) [m/N].
    """
    first, between, second = np.broadcast_arrays(first, between, second)
    h = 1.0 / Hand().stiffness
    a, b = first + h, second + h
    determinant = a * b - between**2
    one, other = (b - 0.5 * between) / determinant, (0.5 * a - between) / determinant
    # A hand from which the other one takes the surface away touches nothing.
    force = np.maximum(
        0.0, [np.where(other < 0.0, 1.0 / a, one), np.where(one < 0.0, 0.5 / b, other)]
    )
    below = force + between * force[::-1] / np.array([first, second])
    return PairForces(force, np.abs(force - np.maximum(0.0, below)))


def fitting_depth(per_metre: PairForces, plain: Floats, dent: float, limit: float) -> Floats:
    """Return depths of the first hand at which both hands feel each other, if there are any [m].

    Args:
        per_metre: Result of `expected`.
        plain: Depths that the places allow anyway, shape (...) [m].
        dent: Largest depth of the first hand's tip below the resting surface at which the hands may
            press to feel each other; a hand yields too, so that it wants to be deeper [m].
        limit: Largest depth that a hand may want to be at [m].

    Returns:
        The plain depth or, if that is not enough and a larger one is allowed, the larger one; at
        most a depth at which a hand presses with nearly `MAX_PRESS`, shape (...) [m].
    """
    needed = _MARGIN / np.maximum(per_metre.enough, 1e-12)
    tip = np.maximum(1.0 - per_metre.force[0] / Hand().stiffness, 1e-12)
    deep = np.maximum(plain, np.minimum(needed, dent / tip))
    hardest = _HARDLY * MAX_PRESS / per_metre.force.max(axis=0)
    return np.asarray(np.minimum(np.minimum(deep, limit), hardest))
