"""The wide ensemble of the campaign (science 3.11): devices of laboratories, and rough networks.

Devices that render 500 to 5,000 N/m and may damp 0, 1 or 8 N s/m; objects of 50 to 10,000 N/m;
contacts down to a fingertip apart and at the same place; hands of 0.3 to 10 N s/m that move,
tremble and let go; friction; loss and jitter to 400 ms one way.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from cohaptic_experiments.campaign.trials import (
    MAX_USERS,
    STILL,
    Trial,
    balloon_coupling,
    draw,
    slab_coupling,
)
from cohaptic_server.numeric import Floats

BUDGETS = (0.0, 1.0, 8.0)  # N s/m
FINGERTIP = 0.01  # m
SAME_PLACE = 1e-3  # share of its compliance that a finger on a common spot has for itself
T = 1e-3  # s
QUIET = 0.5  # share of a run after which the hands hold still, so that a swing is the room's own


def draw_wide(seed: int, index: int, seconds: float) -> Trial:
    """Trial `index` of the wide campaign; the same numbers on every machine.

    Args:
        seed: Seed of the campaign.
        index: Index of the trial.
        seconds: Length of haptics: hands move in the first half, and hold still in the second.
    """
    rng = np.random.default_rng([seed, index, 11])
    n = int(rng.integers(1, MAX_USERS + 1))
    kind = ("balloon", "slab", "close", "same place")[int(rng.integers(0, 4))]
    shape = _shape(rng, kind, n)
    k_o = math.exp(rng.uniform(math.log(50.0), math.log(10_000.0)))
    device = np.exp(rng.uniform(math.log(500.0), math.log(5000.0), n))
    budget = rng.choice(BUDGETS, n)
    frictional = bool(rng.integers(0, 2))
    far = bool(rng.integers(0, 4) == 0)
    # A device that renders K stably has physical damping of at least K T / 2 (Colgate). Its budget
    # and the hand's own damping come on top of that.
    own = 0.5 * device * T
    return Trial(
        object=kind,
        C=shape / (np.diag(shape).mean() * k_o),
        mass=rng.uniform(0.05, 0.5, n),
        damping=np.exp(rng.uniform(math.log(0.3), math.log(10.0), n)) + own,
        stiffness=rng.uniform(100.0, 1000.0, n),
        depth=rng.uniform(0.002, 0.03, n),
        press_at=rng.uniform(0.3, 1.0, n),
        simulation_period=1.0 / rng.uniform(20.0, 100.0),
        up=rng.uniform(0.0, 0.25, n),
        down=rng.uniform(0.0, 0.25, n),
        jitter=rng.uniform(0.0, 0.4 if far else 0.06, n),
        seed=int(rng.integers(0, 2**31)),
        max_stiffness=device,
        budget=budget,
        friction=rng.uniform(0.1, 0.8, n) if frictional else np.zeros(n),
        loss=rng.uniform(0.0, 0.05, n) * float(rng.integers(0, 2)),
        motion=_motion(rng, n, QUIET * seconds, sideways=frictional),
        along=float(rng.uniform(0.5, 1.2)),
    )


def draw_stiff(seed: int, index: int) -> Trial:
    """A room whose object is stiffer than a device of 2,000 N/m; hands as in `draw`."""
    rng = np.random.default_rng([seed, index, 12])
    trial = draw(seed, index)
    n = len(trial.C)
    k_o = math.exp(rng.uniform(math.log(800.0), math.log(8000.0)))
    return replace(
        trial,
        C=trial.C / (np.diag(trial.C).mean() * k_o),
        max_stiffness=np.full(n, 2000.0),
        damping=trial.damping + 0.5 * 2000.0 * T,
    )


def draw_close(seed: int, index: int) -> Trial:
    """A room whose fingers all lie within 10 mm; hands as in `draw`."""
    rng = np.random.default_rng([seed, index, 13])
    trial = draw(seed, index)
    n = len(trial.C)
    k_o = math.exp(rng.uniform(math.log(50.0), math.log(800.0)))
    return replace(trial, object="close", C=slab_coupling(rng, n, FINGERTIP) / k_o)


def draw_weak(seed: int, index: int) -> Trial:
    """A room of hands that damp 0.3 to 1.5 N s/m; the rest as in `draw`."""
    rng = np.random.default_rng([seed, index, 14])
    trial = draw(seed, index)
    return replace(trial, damping=rng.uniform(0.3, 1.5, len(trial.C)))


def _shape(rng: np.random.Generator, kind: str, n: int) -> Floats:
    """Compliance of n contacts, of any scale, shape (n, n)."""
    if kind == "balloon":
        return balloon_coupling(rng, n, FINGERTIP)
    if kind == "same place":
        return np.full((n, n), 1.0 - SAME_PLACE) + SAME_PLACE * np.eye(n)
    return slab_coupling(rng, n, 0.12 if kind == "slab" else FINGERTIP)


def _motion(rng: np.random.Generator, n: int, quiet_at: float, *, sideways: bool) -> Floats:
    """Motion of the hands besides pressing, rows as in `kernel.haptics`, shape (n, 9)."""
    motion = np.zeros((n, 9))
    trembles, moves, leaves = (rng.integers(0, 2, n) for _ in range(3))
    motion[:, 0] = trembles * rng.uniform(0.05e-3, 0.5e-3, n)
    motion[:, 1] = rng.uniform(8.0, 12.0, n)
    motion[:, 2] = rng.uniform(0.0, 2.0 * math.pi, n)
    motion[:, 3] = moves * rng.uniform(0.0, 5e-3, n)
    motion[:, 4] = rng.uniform(0.1, 2.0, n)
    motion[:, 5] = rng.uniform(0.0, 8e-3, n) * float(sideways)
    off = rng.uniform(0.3, 0.6, n) * quiet_at
    motion[:, 6] = np.where(leaves, off, STILL)
    motion[:, 7] = np.where(leaves, off + rng.uniform(0.5, 2.0, n), STILL)
    motion[:, 8] = quiet_at
    return motion
