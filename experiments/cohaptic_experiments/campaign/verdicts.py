"""Runs the campaign `hands` and judges every trial: is it stable, and is the force the truth?

A trial is unstable when the forces of its last two seconds still swing (by more than 5 % of its
largest force, a straight line apart) and swing hardly less than in the two seconds before. A force
that creeps to its value is not a swing: it counts in the error, and its room as slow. A room is
soft where a device is softer than the object: its hands feel the device.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from cohaptic.control.gains import ALPHA, choose_gains
from cohaptic.control.law import Gains, Law
from cohaptic.control.stability.lag_choice import choose_lag, coupling_matrix, coupling_radius
from cohaptic_client.loop.passivity import MAX_DAMPING
from cohaptic_experiments.campaign.kernel import (
    EVERY,
    FIGURES,
    PI,
    PREDICTIVE,
    PROPORTIONAL,
    TAIL,
    T,
    all_haptics,
)
from cohaptic_experiments.campaign.trials import MAX_USERS, Trial
from cohaptic_server.numeric import Floats, Ints

Bools = npt.NDArray[np.bool_]
SWING = 0.05  # share of the largest force
DECAY = 0.7  # a swing that falls below this share of the one before dies out
SMALL = 0.05  # errors are taken relative to the own force, but not below this share of the largest
SLOW = 0.05  # error of a force from which a room that does not swing counts as slow
_NO_LIMIT = 1e6  # N/m; a device that is not on trial
CODES = {Law.PROPORTIONAL: PROPORTIONAL, Law.PI: PI, Law.PREDICTIVE: PREDICTIVE}


@dataclass(frozen=True, slots=True)
class Variant:
    """What everybody in a room runs.

    Args:
        law: Local model.
        coupled: Whether gains respect the other contacts; False is the paper's rule, by C_ii alone.
        budget: What the passivity layer may damp on every device; None: what the trial says, which
            is all of `MAX_DAMPING` where it says nothing [N s/m].
    """

    law: Law
    coupled: bool = True
    budget: float | None = None

    @property
    def rule(self) -> str:
        """Name of the law, and of the rule for its gains where there are two."""
        return self.law.value if self.coupled else "paper's rule"

    @property
    def name(self) -> str:
        """For tables."""
        if self.budget is None:
            return f"{self.rule} + passivity"
        return self.rule if self.budget == 0.0 else f"{self.rule} + {self.budget:g} N s/m"

    @property
    def without_passivity(self) -> Variant:
        """The same with the layer off."""
        return Variant(self.law, self.coupled, 0.0)

    def budgets(self, trial: Trial) -> Floats:
        """What the layer may damp on each device of a trial, shape (n,) [N s/m]."""
        if self.budget is not None:
            return np.full(len(trial.C), self.budget)
        return np.full(len(trial.C), MAX_DAMPING) if trial.budget is None else trial.budget


@dataclass(frozen=True, eq=False)
class Verdicts:
    """Of every trial under one variant.

    Args:
        unstable: Shape (trials,).
        slow: Whether a force is still off by more than `SLOW` though none swings, shape (trials,).
        soft: Whether a device is softer than the object, shape (trials,).
        swing: In the last two seconds, share of the largest true force, shape (trials,).
        error: Largest relative error of a force in the steady state, shape (trials,); of rooms
            without friction, whose steady state depends on the way to it.
        errors: Of every user of every stable trial without friction.
        users: Size of the room of each of `errors`.
        damping: RMS of the passivity layer's force over that of the law's, shape (trials,).
        step: Largest change of a force in a period beyond what the hand's own motion and the
            damping explain, shape (trials,) [N].
        faded: Share of periods in which a force was faded, shape (trials,).
        lag: Of the rooms, shape (trials,) [s].
    """

    unstable: Bools
    slow: Bools
    soft: Bools
    swing: Floats
    error: Floats
    errors: Floats
    users: Ints
    damping: Floats
    step: Floats
    faded: Floats
    lag: Floats


def gains_of(trial: Trial, variant: Variant) -> list[Gains]:
    """What the server would choose for everybody of a trial."""
    rows = trial.C if variant.coupled else np.diag(np.diag(trial.C))
    limit = np.full(len(trial.C), _NO_LIMIT) if trial.max_stiffness is None else trial.max_stiffness
    return [
        choose_gains(
            variant.law,
            row,
            i,
            max_stiffness=float(limit[i]),
            loop_delay=float(trial.loop_delay[i]),
            simulation_period=trial.simulation_period,
            alpha=ALPHA,
        )
        for i, row in enumerate(rows.tolist())
    ]


def lag_of(trial: Trial, variant: Variant) -> float:
    """What the server would choose for the room [s]; the paper's laws were made without one."""
    if variant.law is not Law.PREDICTIVE:
        return 0.0
    k = trial.gains
    if trial.friction is None or not trial.friction.any():
        S = coupling_matrix(trial.C, [np.array([[one]]) for one in k])
    else:
        C = trial.blocks
        own = [C[3 * i : 3 * i + 3, 3 * i : 3 * i + 3] for i in range(len(k))]
        S = coupling_matrix(
            C, [one * c[0, 0] * np.linalg.inv(c) for one, c in zip(k, own, strict=True)]
        )
    longest = float(trial.loop_delay.max()) + trial.simulation_period
    return choose_lag(coupling_radius(S), longest, float(variant.budgets(trial).min())).lag


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
    parts: list[tuple[Floats, Floats, Floats]] = []
    for start in range(0, len(trials), chunk):
        parts.append(_run(trials[start : start + chunk], variant, seconds, TAIL))
        progress(len(trials[start : start + chunk]))
    tails, figures, lags = (np.concatenate(part) for part in zip(*parts, strict=True))
    return judge(trials, tails, figures, lags)


def trace(trial: Trial, variant: Variant, *, seconds: float) -> tuple[Floats, Floats]:
    """Time, shape (k,) [s], and forces on the hands, shape (k, users) [N], of one trial."""
    tails, _, _ = _run([trial], variant, seconds, seconds)
    forces = tails[0, :, : len(trial.C)]
    return np.asarray(np.arange(len(forces)) * EVERY * T, dtype=np.float64), forces


def _run(
    trials: Sequence[Trial], variant: Variant, seconds: float, tail: float
) -> tuple[Floats, Floats, Floats]:
    """Tails, figures and lags of some trials."""
    count, most = len(trials), MAX_USERS
    C = np.zeros((count, 3 * most, 3 * most))
    hands, devices, motions, links, gains = (
        np.zeros((count, most, columns)) for columns in (5, 3, 9, 4, 2)
    )
    lags = np.array([lag_of(trial, variant) for trial in trials])
    for t, trial in enumerate(trials):
        n, none = len(trial.C), np.zeros(len(trial.C))
        C[t, : 3 * n, : 3 * n] = trial.blocks
        hands[t, :n] = np.stack(
            [trial.mass, trial.damping, trial.stiffness, trial.depth, trial.press_at], axis=1
        )
        gains[t, :n] = gains_of(trial, variant)
        friction = none if trial.friction is None else trial.friction
        stiffest = gains[t, :n, 0] if trial.max_stiffness is None else trial.max_stiffness
        devices[t, :n] = np.stack([variant.budgets(trial), friction, stiffest], axis=1)
        motions[t, :n] = trial.motion
        loss = none if trial.loss is None else trial.loss
        links[t, :n] = np.stack([trial.up, trial.down, trial.jitter, loss], axis=1)
    tails = np.zeros((count, round(min(tail, seconds) / T) // EVERY, most))
    figures = np.zeros((count, FIGURES))
    all_haptics(
        CODES[variant.law],
        np.array([len(trial.C) for trial in trials]),
        C,
        hands,
        devices,
        motions,
        links,
        gains,
        lags,
        np.array([trial.simulation_period for trial in trials]),
        np.array([trial.seed for trial in trials]),
        seconds,
        tails,
        figures,
    )
    return tails, figures, lags


def judge(
    trials: Sequence[Trial], tails: Floats, figures: Floats, lags: Floats | None = None
) -> Verdicts:
    """Verdicts on trials.

    Args:
        trials: That were played.
        tails: Forces at their end, shape (trials, k, users) [N].
        figures: As `hands_kernel.haptics` writes them, shape (trials, 4).
        lags: Of the rooms, shape (trials,) [s]; None where there is none.
    """
    half = tails.shape[1] // 2
    truths = [trial.truth for trial in trials]
    largest = np.array([truth.max() for truth in truths])
    now, before = _swing(tails[:, half:]) / largest, _swing(tails[:, :half]) / largest
    unstable = (now > SWING) & (now > DECAY * before)
    steady = tails[:, -(tails.shape[1] // 8) :].mean(axis=1)
    error = np.zeros(len(trials))
    errors: list[float] = []
    users: list[int] = []
    for t, (trial, truth) in enumerate(zip(trials, truths, strict=True)):
        if trial.friction is not None and trial.friction.any():
            continue
        n = len(truth)
        relative = np.abs(steady[t, :n] - truth) / np.maximum(truth, SMALL * largest[t])
        error[t] = relative.max()
        if not unstable[t]:
            errors += relative.tolist()
            users += [n] * n
    soft = np.array([bool((trial.gains * np.diag(trial.C) < 0.99).any()) for trial in trials])
    damping = np.sqrt(figures[:, 0] / np.maximum(figures[:, 1], 1e-12))
    return Verdicts(
        unstable=unstable,
        slow=~unstable & (error > SLOW),
        soft=soft,
        swing=now,
        error=error,
        errors=np.array(errors),
        users=np.array(users),
        damping=damping,
        step=figures[:, 2],
        faded=figures[:, 3],
        lag=np.zeros(len(trials)) if lags is None else lags,
    )


def _swing(forces: Floats) -> Floats:
    """Largest swing of a user of each trial about the straight line through it, shape (trials,)."""
    k = forces.shape[1]
    t = np.linspace(-1.0, 1.0, k)[None, :, None]
    mean = forces.mean(axis=1, keepdims=True)
    slope = (forces * t).sum(axis=1, keepdims=True) / (t * t).sum()
    return np.asarray(np.ptp(forces - mean - slope * t, axis=1).max(axis=1))
