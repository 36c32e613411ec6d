"""Judges trials of the campaign `hands`: stability, and steady forces against the reference.

A trial is unstable when the forces of its last two seconds still swing (by more than 5 % of its
largest force, a straight line apart) and swing hardly less than in the two seconds before. A force
that creeps to its value is not a swing: it counts in the error, and its room as slow. A room is
soft where a device is softer than the object: its hands feel the device.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from cohaptic_experiments.campaign.trials import Trial
from cohaptic_server.numeric import Floats, Ints

Bools = npt.NDArray[np.bool_]
SWING = 0.05  # share of the largest force
DECAY = 0.7  # a swing that falls below this share of the one before dies out
SMALL = 0.05  # errors are taken relative to the own force, but not below this share of the largest
SLOW = 0.05  # error of a force from which a room that does not swing counts as slow


@dataclass(frozen=True, eq=False)
class Verdicts:
    """Verdicts on every trial under one variant.

    Args:
        unstable: Shape (trials,).
        slow: Whether a force is still off by more than `SLOW` though none swings, shape (trials,).
        soft: Whether a device is softer than the object, shape (trials,).
        swing: In the last two seconds, share of the largest true force, shape (trials,).
        error: Largest relative error of a force in the steady state, shape (trials,); of rooms
            without friction, whose steady state depends on the way to it.
        errors: Errors of every user of every stable trial without friction.
        users: Size of the room of each of `errors`.
        damping: RMS of the passivity layer's force over that of the law's, shape (trials,).
        step: Largest change of a force in a period that is not explained by the hand's own
            motion and the damping, shape (trials,) [N].
        faded: Share of periods in which a force was faded, shape (trials,).
        lag: Lag of the rooms, shape (trials,) [s].
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


def judge(
    trials: Sequence[Trial], tails: Floats, figures: Floats, lags: Floats | None = None
) -> Verdicts:
    """Judge trials.

    Args:
        trials: The rooms.
        tails: Forces at the end of each, shape (trials, k, users) [N].
        figures: As `kernel.haptics` writes them, shape (trials, 4).
        lags: Lags of the rooms, shape (trials,) [s]; None for rooms without lag.
    """
    half = tails.shape[1] // 2
    references = [trial.reference for trial in trials]
    largest = np.array([reference.max() for reference in references])
    now, before = _swing(tails[:, half:]) / largest, _swing(tails[:, :half]) / largest
    unstable = (now > SWING) & (now > DECAY * before)
    steady = tails[:, -(tails.shape[1] // 8) :].mean(axis=1)
    error = np.zeros(len(trials))
    errors: list[float] = []
    users: list[int] = []
    for t, (trial, reference) in enumerate(zip(trials, references, strict=True)):
        if trial.friction is not None and trial.friction.any():
            continue
        n = len(reference)
        error_of_force = np.abs(steady[t, :n] - reference)
        relative = error_of_force / np.maximum(reference, SMALL * largest[t])
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
