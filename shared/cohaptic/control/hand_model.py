"""Models of hands, and the forces of several hands that press on one body (science 3.15).

A model is a mass with a damper and a spring, m y'' + b y' + k y = f: the hand gives way by y under
the force f. With the compliance C between contacts and the depth x of each hand below the surface
without any force, the forces solve C f = x where hands press, and are zero elsewhere.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, NamedTuple


class HandModel(NamedTuple):
    """A model of a hand.

    Fields:
        mass: Mass m [kg].
        damping: Damping b [N s/m].
        stiffness: Stiffness k [N/m].
    """

    mass: float
    damping: float
    stiffness: float


# The hand that everybody is taken for at first: a fingertip that presses on purpose (Hajian and
# Howe 1997 find 0.1 to 0.2 kg, 3 to 12 N s/m and 100 to 800 N/m).
USUAL_HAND: Final = HandModel(0.15, 8.0, 400.0)


class Give(NamedTuple):
    """Displacement of a model, out of the body [m], and its velocity [m/s]."""

    y: float = 0.0
    v: float = 0.0


def give_way(give: Give, model: HandModel, force: float, dt: float) -> Give:
    """Return a model's displacement after a time under a force.

    Args:
        give: Displacement and velocity before.
        model: Model of the hand.
        force: Force on the hand, out of the body [N].
        dt: Time [s].
    """
    # The damping acts on the new velocity, so that no damping makes a period unstable.
    v = give.v + dt / model.mass * (force - model.stiffness * give.y)
    v /= 1.0 + dt * model.damping / model.mass
    return Give(give.y + dt * v, v)


# Sweeps of one period. From the forces of the last period on, two to five suffice; hands that share
# nearly all of their compliance need all of them after a jump.
_SWEEPS: Final = 24
_ENOUGH: Final = 1e-6  # N; a sweep that changes no force by more is the last one


def contact_forces(
    C: Sequence[Sequence[float]],
    depth: Sequence[float],
    most: Sequence[float],
    start: Sequence[float],
) -> list[float]:
    """Return the force of each of n hands: C f = x within 0 and each hand's largest force [N].

    The method is Gauss-Seidel with bounds, which converges for every positive definite C.

    Args:
        C: Compliance between contacts, with that of each hand's device, shape (n, n) [m/N].
        depth: Depth x of each hand below the surface without any force, shape (n,) [m].
        most: Largest force of each hand, shape (n,) [N].
        start: Forces to begin with, shape (n,) [N].
    """
    forces, n = list(start), len(depth)
    for _ in range(_SWEEPS):
        change = 0.0
        for i in range(n):
            row, rest, before = C[i], depth[i], forces[i]
            for j in range(n):
                rest -= row[j] * forces[j]
            force = before + rest / row[i]
            if force > most[i]:
                force = most[i]
            if not force > 0.0:  # NaN too
                force = 0.0
            forces[i] = force
            change = max(change, abs(force - before))
        if change <= _ENOUGH:
            break
    return forces
