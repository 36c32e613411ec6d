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


class Deflection(NamedTuple):
    """Displacement of a model, out of the body [m], and its velocity [m/s]."""

    y: float = 0.0
    v: float = 0.0


def deflect(deflection: Deflection, model: HandModel, force: float, dt: float) -> Deflection:
    """Return a model's displacement after a time under a force.

    Args:
        deflection: Displacement and velocity before.
        model: Model of the hand.
        force: Force on the hand, out of the body [N].
        dt: Time [s].
    """
    # (3.15) Z' y' = f, that is m y'' + b y' + k y = f
    # The damping acts on the new velocity, so that no damping makes a period unstable, and no mass
    # is too light for its spring.
    mass = max(model.mass, model.stiffness * dt * dt)
    v = deflection.v + dt / mass * (force - model.stiffness * deflection.y)
    v /= 1.0 + dt * model.damping / mass
    return Deflection(deflection.y + dt * v, v)


# Rounds in which the hands at no bound are sought. From the forces of the last period on, the first
# one mostly finds them. Their number bounds the time of a period. Reasoned, not measured.
_ROUNDS: Final = 12
_SWEEPS: Final = 3  # of Gauss-Seidel in each round. Reasoned, not measured.
# N; a force beyond its bound by less is at the bound: rounding of doubles, a millionth of the least
# force that counts.
_ROUNDING: Final = 1e-9


def contact_forces(
    C: Sequence[Sequence[float]],
    depth: Sequence[float],
    limit: Sequence[float],
    start: Sequence[float],
) -> list[float]:
    """Return the force of each of n hands: C f = x within 0 and each hand's largest force [N].

    Sweeps of Gauss-Seidel with bounds, which converge for every positive definite C, find the hands
    whose force is at a bound; the forces of the others are then solved for.

    Args:
        C: Compliance between contacts, with that of each hand's device, shape (n, n) [m/N].
        depth: Depth x of each hand below the surface without any force, shape (n,) [m].
        limit: Largest force of each hand, shape (n,) [N].
        start: Forces to begin with, shape (n,) [N].
    """
    forces, n = list(start), len(depth)
    for _ in range(_ROUNDS):
        for _ in range(_SWEEPS):
            for i in range(n):
                row, rest = C[i], depth[i]
                for j in range(n):
                    rest -= row[j] * forces[j]
                force = min(limit[i], forces[i] + rest / row[i])
                forces[i] = force if force > 0.0 else 0.0  # NaN, too
        free = [i for i in range(n) if 0.0 < forces[i] < limit[i]]
        rest_of = [depth[i] - sum([C[i][j] * forces[j] for j in range(n)]) for i in free]
        change = solved([[C[i][j] for j in free] for i in free], rest_of)
        for i, by in zip(free, change, strict=True):
            forces[i] += by
        solved_all = True
        for i in range(n):
            rest = depth[i] - sum([C[i][j] * forces[j] for j in range(n)])
            off = _ROUNDING * C[i][i]
            if i in free:
                solved_all = solved_all and -_ROUNDING <= forces[i] <= limit[i] + _ROUNDING
            elif forces[i] > 0.0:  # at its largest, where it would rather be larger
                solved_all = solved_all and rest >= -off
            else:
                solved_all = solved_all and rest <= off
        forces = [min(limit[i], forces[i]) if forces[i] > 0.0 else 0.0 for i in range(n)]
        if solved_all:
            break
    return forces


def stiffness(
    C: Sequence[Sequence[float]], forces: Sequence[float], limit: Sequence[float]
) -> list[float]:
    """Return the change of the first hand's force per change of each hand's depth, (n,) [N/m].

    The other tips stay where they are, and so do the forces at a bound.

    Args:
        C: As for `contact_forces`.
        forces: Its result.
        limit: As for `contact_forces`.
    """
    found = [0.0] * len(forces)
    free = [i for i in range(len(forces)) if 0.0 < forces[i] < limit[i]]
    if not free or free[0] != 0:
        return found
    # A row of the inverse: the transposed matrix, from its last column on.
    row = solved(
        [[C[j][i] for j in reversed(free)] for i in reversed(free)],
        [0.0] * (len(free) - 1) + [1.0],
    )
    for i, value in zip(reversed(free), row, strict=True):
        found[i] = value
    return found


def solved(A: list[list[float]], b: list[float]) -> list[float]:
    """Solve A x = b by elimination; both are overwritten.

    Args:
        A: Matrix that is positive definite but for a factor of a row or a column, shape (n, n).
        b: Right-hand side, shape (n,).
    """
    n = len(b)
    for k in range(n - 1, 0, -1):  # from the last row up: the first one need not be symmetric
        for i in range(k):
            fraction = A[i][k] / A[k][k]
            if fraction != 0.0:
                for j in range(k):
                    A[i][j] -= fraction * A[k][j]
                b[i] -= fraction * b[k]
    for k in range(n):
        for j in range(k):
            b[k] -= A[k][j] * b[j]
        b[k] /= A[k][k]
    return b
