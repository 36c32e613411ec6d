"""What the server anticipates in the compiled room (science 3.13, `world/lags/planning.py`)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cohaptic.control.stability.anticipation import LARGEST
from cohaptic_experiments.campaign.compiled import compiled
from cohaptic_server.numeric import Floats, Ints

REMEMBERED = 256  # ticks, longer than a message may be on its way and back


class Plan(NamedTuple):
    """The anticipation of a room; each contact has three rows, of which some are never used.

    Fields:
        S: Coupling of science 3.8, shape (3 n, 3 n); empty where nothing is anticipated.
        root: Square roots of K, which is diagonal in a contact's frame, shape (3 n,).
        fraction: 1 / (1 + kappa) of the room, shape (1,).
        touching: Users of whom `part` and `solve` are, shape (n,).
        part: X, in newton per newton, shape (3 n, 3 n).
        solve: (1 + X)^-1, likewise.
        past: What the body carried in the last ticks, a ring, shape (REMEMBERED, n, 3) [N].
        tick: Number of the last tick, shape (1,).
        answered: Tick of the patch that each user's newest sample answers, shape (n,).
    """

    S: Floats
    root: Floats
    fraction: Floats
    touching: Floats
    part: Floats
    solve: Floats
    past: Floats
    tick: Ints
    answered: Ints


@compiled
def empty_plan(S: Floats, root: Floats, fraction: float, users: int) -> Plan:
    """Before the first tick.

    Args:
        S: As in `Plan`.
        root: As in `Plan`.
        fraction: As in `Plan`.
        users: n.
    """
    rows = 3 * users
    return Plan(
        S,
        root,
        np.full(1, fraction),
        np.zeros(users),
        np.zeros((rows, rows)),
        np.eye(rows),
        np.zeros((REMEMBERED, users, 3)),
        np.zeros(1, np.int64),
        np.zeros(users, np.int64),
    )


@compiled
def anticipate(plan: Plan, requested: Floats) -> Floats:
    """Forces that hands are about to feel, as `world.applied_forces.anticipate`, shape (n, 3).

    Args:
        plan: Plan of the room; `part` and `solve` are found anew when a hand comes or goes.
        requested: Forces of the newest samples, shape (n, 3) [N].
    """
    n = len(requested)
    if len(plan.S) == 0:
        return requested
    changed = False
    for i in range(n):
        touches = 1.0 if requested[i, 0] > 0.0 else 0.0
        if touches != plan.touching[i]:
            plan.touching[i] = touches
            changed = True
    if changed:
        _find(plan)
    difference = np.zeros(3 * n)
    for i in range(n):
        then = plan.past[plan.answered[i] % REMEMBERED]
        for a in range(3):
            for j in range(n):
                for b in range(3):
                    difference[3 * i + a] += plan.part[3 * i + a, 3 * j + b] * (
                        requested[j, b] - then[j, b]
                    )
    change = plan.solve @ difference
    ahead = np.copy(requested)
    for i in range(n):
        if plan.touching[i] > 0.0:
            for a in range(3):
                ahead[i, a] -= change[3 * i + a]
            ahead[i, 0] = max(0.0, ahead[i, 0])
    return ahead


@compiled
def _find(plan: Plan) -> None:
    """X and (1 + X)^-1 of those who touch."""
    rows = len(plan.root)
    S = np.copy(plan.S)
    for i in range(rows):
        if plan.touching[i // 3] == 0.0:
            S[i, :] = 0.0
            S[:, i] = 0.0
    values, vectors = np.linalg.eigh(S)
    for k in range(rows):
        part = max(values[k], plan.fraction[0] * max(values[k], -LARGEST))
        values[k] = part
    for i in range(rows):
        for j in range(rows):
            x, y = 0.0, 0.0
            for k in range(rows):
                both = vectors[i, k] * vectors[j, k]
                x += both * values[k]
                y += both / (1.0 + values[k])
            ratio = plan.root[i] / plan.root[j]
            plan.part[i, j] = x * ratio
            plan.solve[i, j] = y * ratio
