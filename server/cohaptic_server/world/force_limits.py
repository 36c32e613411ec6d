"""Limits on the sum and on the rate of change of the forces that the body gets in a tick.

A press that grows to 6 N within 0.1 s changes the force on a neighbour that shares all of the
hand's compliance by 60 N/s, and is not limited. If several users together would change the force on
another user faster, the largest changes are cut to a common cap and smaller changes stay as they
are, so that only the user who shakes the body is slowed down. A contact that slides over the body
also changes the forces on others, without a change of its own force; this is left to the clients,
whose own limit is stricter (`cohaptic_client.loop.slew`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from cohaptic.control.stability.lag_choice import kept
from cohaptic.vec import norm
from cohaptic_server.numeric import Floats
from cohaptic_server.world.state import Touch

# N/s by which all others together may change the force on one hand. Fingers that tap reach about
# 100 N/s on their own force, and a neighbour feels the share that it has of their compliance.
EFFECT_RATE = 60.0
MAX_SUM = 160.0  # N, of all forces on a body: sixteen hands at the 10 N of a usual device
# Largest change of the force on one hand per change of another's force. A hand at a stiff place
# beside a soft one can be moved by several times the other's force; ten bounds that ratio where
# the coupling is not known yet.
MAX_COUPLING_RATIO = 10.0


def fair_cap(demands: Floats, total: float) -> float:
    """Return the max-min fair cap that cuts demands to the sum `total`; infinite if none is cut.

    Args:
        demands: Demands of the users, none negative, shape (n,).
        total: Amount available to all users together, in the unit of the demands.
    """
    if demands.sum() <= total:
        return np.inf
    available, users = total, len(demands)
    for demand in np.sort(demands):
        # Smaller demands are met in full; the larger ones share the rest evenly.
        if available <= demand * users:
            break
        available -= demand
        users -= 1
    return available / max(1, users)


def limit_forces(requested: Floats, max_force: Floats) -> Floats:
    """Cut normal forces to the limits of each contact and of the body, shape (n,) [N].

    Args:
        requested: Force requested by each user, shape (n,) [N].
        max_force: Largest force of each contact, shape (n,) [N].
    """
    forces = np.minimum(requested, max_force)
    return np.minimum(forces, fair_cap(forces, MAX_SUM))


def allowed_shares(change: Floats, stiffness: Floats, C: Floats, max_effect: float) -> Floats:
    """Share of each user's change of force that is allowed in this tick, shape (n,), 0 to 1.

    Args:
        change: Magnitude of each user's change of force, shape (n,) [N].
        stiffness: Stiffness K of each hand, shape (n,) [N/m].
        C: Compliance between contacts, infinite where it is not known yet, shape (n, n) [m/N].
        max_effect: Largest change of the force on one hand by all others together [N].
    """
    # The campaign compiles this function with numba, which supports only a part of numpy.
    shares = np.ones_like(change)
    # Change of the force on each hand (row) by each user (column); an unknown compliance is
    # replaced by the worst case.
    effect = np.minimum(stiffness.reshape(-1, 1) * np.abs(C), MAX_COUPLING_RATIO) * change
    effect.reshape(-1)[:: len(change) + 1] = 0.0  # its diagonal
    moved = effect.sum(axis=1)
    if not (moved > max_effect).any():
        return shares
    for i in np.flatnonzero(moved > max_effect):
        row = effect[i]
        shares = np.minimum(shares, fair_cap(row, max_effect) / np.maximum(row, 1e-300))
    return shares


def low_pass(previous: Floats, requested: Floats, lag: Floats, dt: float) -> Floats:
    """Return the forces after one tick of a first-order lag, any shape [N].

    Args:
        previous: Forces applied in the last tick [N].
        requested: Input of the lag in this tick [N].
        lag: Time constant of each force, of a shape that broadcasts [s].
        dt: Simulation period [s].
    """
    return np.asarray(requested + kept(lag, dt) * (previous - requested))


def within_budget(touches: Sequence[Touch], budget: float) -> list[Touch]:
    """Return samples whose largest forces are cut fairly, so that the sum stays within a budget.

    Args:
        touches: Newest samples of all users.
        budget: Largest sum of their forces [N].
    """
    demands = np.array([min(t.max_force, norm(t.force)) if t.fresh else 0.0 for t in touches])
    cap = fair_cap(demands, budget)
    return [t if t.max_force <= cap else replace(t, max_force=cap) for t in touches]
