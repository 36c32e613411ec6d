"""Runs the campaign `hands` and judges every trial: is it stable, and is the force the truth?

A trial is unstable when the forces of its last two seconds still swing (by more than 5 % of its
largest force, a straight line apart) and swing hardly less than in the two seconds before. A force
that creeps to its value is not a swing: it counts in the error.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from cohaptic.control.gains import ALPHA, choose_gains
from cohaptic.control.law import Gains, Law
from cohaptic_client.passivity import MAX_DAMPING
from cohaptic_experiments.hands_kernel import (
    EVERY,
    PI,
    PREDICTIVE,
    PROPORTIONAL,
    TAIL,
    T,
    all_haptics,
)
from cohaptic_experiments.hands_trials import MAX_USERS, Trial
from cohaptic_server.bodies.mesh import Floats, Ints

Bools = npt.NDArray[np.bool_]
SWING = 0.05  # share of the largest force
DECAY = 0.7  # a swing that falls below this share of the one before dies out
SMALL = 0.05  # errors are taken relative to the own force, but not below this share of the largest
MAX_STIFFNESS = 1e6  # N/m; the device is not on trial
CODES = {Law.PROPORTIONAL: PROPORTIONAL, Law.PI: PI, Law.PREDICTIVE: PREDICTIVE}


@dataclass(frozen=True, slots=True)
class Variant:
    """What everybody in a room runs.

    Args:
        law: Local model.
        coupled: Whether gains respect the other contacts; False is the paper's rule, by C_ii alone.
        passive: Whether the passivity layer is on.
    """

    law: Law
    coupled: bool = True
    passive: bool = True

    @property
    def rule(self) -> str:
        """Name of the law, and of the rule for its gains where there are two."""
        return self.law.value if self.coupled else "paper's rule"

    @property
    def name(self) -> str:
        """For tables."""
        return f"{self.rule} + passivity" if self.passive else self.rule

    @property
    def without_passivity(self) -> Variant:
        """The same with the layer off."""
        return Variant(self.law, self.coupled, False)


@dataclass(frozen=True, eq=False)
class Verdicts:
    """Of every trial under one variant.

    Args:
        unstable: Shape (trials,).
        swing: In the last two seconds, share of the largest true force, shape (trials,).
        error: Largest relative error of a force in the steady state, shape (trials,).
        errors: Of every user of every stable trial.
        users: Size of the room of each of `errors`.
        damping: RMS of the passivity layer's force over that of the law's, shape (trials,).
    """

    unstable: Bools
    swing: Floats
    error: Floats
    errors: Floats
    users: Ints
    damping: Floats


def gains_of(trial: Trial, variant: Variant) -> list[Gains]:
    """What the server would choose for everybody of a trial."""
    rows = trial.C if variant.coupled else np.diag(np.diag(trial.C))
    return [
        choose_gains(
            variant.law,
            row,
            i,
            max_stiffness=MAX_STIFFNESS,
            loop_delay=float(trial.loop_delay[i]),
            simulation_period=trial.simulation_period,
            alpha=ALPHA,
        )
        for i, row in enumerate(rows.tolist())
    ]


def play(
    trials: Sequence[Trial],
    variant: Variant,
    *,
    seconds: float,
    progress: Callable[[int], None] = lambda _done: None,
    chunk: int = 100,
) -> Verdicts:
    """Run every trial under one variant.

    Args:
        trials: To be run.
        variant: Of everybody.
        seconds: Of haptics per trial.
        progress: Called with the number of trials done, after each chunk.
        chunk: Trials that run side by side between two calls of `progress`.
    """
    parts: list[tuple[Floats, Floats]] = []
    for start in range(0, len(trials), chunk):
        parts.append(_run(trials[start : start + chunk], variant, seconds, TAIL))
        progress(len(trials[start : start + chunk]))
    tails = np.concatenate([tail for tail, _ in parts])
    sums = np.concatenate([s for _, s in parts])
    return judge(trials, tails, sums)


def trace(trial: Trial, variant: Variant, *, seconds: float) -> tuple[Floats, Floats]:
    """Time, shape (k,) [s], and forces on the hands, shape (k, users) [N], of one trial."""
    tails, _ = _run([trial], variant, seconds, seconds)
    forces = tails[0, :, : len(trial.C)]
    return np.asarray(np.arange(len(forces)) * EVERY * T, dtype=np.float64), forces


def _run(
    trials: Sequence[Trial], variant: Variant, seconds: float, tail: float
) -> tuple[Floats, Floats]:
    count, most = len(trials), MAX_USERS
    C = np.zeros((count, most, most))
    hands, links, gains = (
        np.zeros((count, most, 5)),
        np.zeros((count, most, 3)),
        np.zeros((count, most, 2)),
    )
    for t, trial in enumerate(trials):
        n = len(trial.C)
        C[t, :n, :n] = trial.C
        hands[t, :n] = np.stack(
            [trial.mass, trial.damping, trial.stiffness, trial.depth, trial.press_at], axis=1
        )
        links[t, :n] = np.stack([trial.up, trial.down, trial.jitter], axis=1)
        gains[t, :n] = gains_of(trial, variant)
    tails = np.zeros((count, round(min(tail, seconds) / T) // EVERY, most))
    sums = np.zeros((count, 2))
    all_haptics(
        CODES[variant.law],
        MAX_DAMPING if variant.passive else 0.0,
        np.array([len(trial.C) for trial in trials]),
        C,
        hands,
        links,
        gains,
        np.array([trial.simulation_period for trial in trials]),
        np.array([trial.seed for trial in trials]),
        seconds,
        tails,
        sums,
    )
    return tails, sums


def judge(trials: Sequence[Trial], tails: Floats, sums: Floats) -> Verdicts:
    """Verdicts on the forces at the end of each trial, shape (trials, k, users) [N]."""
    half = tails.shape[1] // 2
    truths = [trial.truth for trial in trials]
    largest = np.array([truth.max() for truth in truths])
    now, before = _swing(tails[:, half:]) / largest, _swing(tails[:, :half]) / largest
    unstable = (now > SWING) & (now > DECAY * before)
    steady = tails[:, -(tails.shape[1] // 8) :].mean(axis=1)
    error = np.zeros(len(trials))
    errors: list[float] = []
    users: list[int] = []
    for t, truth in enumerate(truths):
        n = len(truth)
        relative = np.abs(steady[t, :n] - truth) / np.maximum(truth, SMALL * largest[t])
        error[t] = relative.max()
        if not unstable[t]:
            errors += relative.tolist()
            users += [n] * n
    damping = np.sqrt(sums[:, 0] / np.maximum(sums[:, 1], 1e-12))
    return Verdicts(unstable, now, error, np.array(errors), np.array(users), damping)


def _swing(forces: Floats) -> Floats:
    """Largest swing of a user of each trial about the straight line through it, shape (trials,)."""
    k = forces.shape[1]
    t = np.linspace(-1.0, 1.0, k)[None, :, None]
    mean = forces.mean(axis=1, keepdims=True)
    slope = (forces * t).sum(axis=1, keepdims=True) / (t * t).sum()
    return np.asarray(np.ptp(forces - mean - slope * t, axis=1).max(axis=1))
