"""Limits of the forces that enter the body in a tick: their sum, and how fast they may change.

A press of 6 N within 0.1 s, as hands press, moves a neighbour who shares all of the compliance by
60 N/s, and passes untouched. Where several together would move somebody faster, those who change
most are cut down to one level, and nobody who changes less is touched: the one who shakes pays.
A contact that is dragged over the body changes what others feel as well, without a change of force:
that is left to the clients, whose own limit is stricter (`cohaptic_client.loop.slew`).
"""

from __future__ import annotations

import numpy as np

from cohaptic.control.stability.lag_choice import kept
from cohaptic_server.numeric import Floats

# N/s by which all others together may change the force on one hand. Fingers that tap reach about
# 100 N/s on their own force; a neighbour gets the share that it has of their compliance.
EFFECT_RATE = 60.0
MAX_SUM = 160.0  # N on a body: sixteen hands at the 10 N of a usual device


def level(demands: Floats, total: float) -> float:
    """The level to which demands are cut so that they sum to `total`; infinite if they do already.

    Args:
        demands: None negative, shape (n,).
        total: That all may have together.
    """
    if demands.sum() <= total:
        return np.inf
    left, others = total, len(demands)
    for demand in np.sort(demands):
        # With the smaller ones left whole, what is over is shared by the others.
        if left <= demand * others:
            break
        left -= demand
        others -= 1
    return left / max(1, others)


def bounded(wanted: Floats, deepest: Floats) -> Floats:
    """Normal forces that a body is asked to carry, shape (n,) [N].

    Args:
        wanted: Of each user, shape (n,) [N].
        deepest: Force that takes each through the whole body, shape (n,) [N].
    """
    forces = np.minimum(wanted, deepest)
    return np.minimum(forces, level(forces, MAX_SUM))


def shares_of_change(change: Floats, stiffness: Floats, C: Floats, most: float) -> Floats:
    """Share of its change that each user may make in this tick, shape (n,), 0 to 1.

    Args:
        change: Magnitude of each user's, shape (n,) [N].
        stiffness: K of each hand, shape (n,) [N/m].
        C: Compliance between contacts, infinite where it is not known yet, shape (n, n) [m/N].
        most: Change of a hand's force by all others together [N].
    """
    shares = np.ones(len(change))
    # Of what is not known the worst: one contact at the place of the other.
    effect = np.minimum(np.expand_dims(stiffness, 1) * np.abs(C), MOST_COUPLED) * change
    np.fill_diagonal(effect, 0.0)
    for row in effect:
        if row.sum() > most:
            shares = np.minimum(shares, level(row, most) / np.maximum(row, 1e-300))
    return shares


# Times its own force that a hand can be moved by: that of a soft place beside a stiff one.
MOST_COUPLED = 10.0


def behind(before: Floats, now: Floats, lag: Floats, dt: float) -> Floats:
    """Forces behind a lag after a tick in which `now` came in, any shape [N].

    Args:
        before: Carried in the last tick [N].
        now: That came in [N].
        lag: Of each, of a shape that fits [s].
        dt: Simulation period [s].
    """
    return np.asarray(now + kept(lag, dt) * (before - now))
