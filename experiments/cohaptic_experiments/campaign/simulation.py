"""Runs trials of the campaign `hands` in the compiled kernel, and has them judged."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np

from cohaptic.control.law import Law
from cohaptic_experiments.campaign.batch import all_haptics
from cohaptic_experiments.campaign.kernel import (
    EVERY,
    FIGURES,
    PI,
    PREDICTIVE,
    PROPORTIONAL,
    TAIL,
    T,
)
from cohaptic_experiments.campaign.trials import MAX_USERS, Trial
from cohaptic_experiments.campaign.variants import Variant, gains_of, lag_of
from cohaptic_experiments.campaign.verdicts import Verdicts, judge
from cohaptic_experiments.machines import Over, here
from cohaptic_server.numeric import Floats

CODES = {Law.PROPORTIONAL: PROPORTIONAL, Law.PI: PI, Law.PREDICTIVE: PREDICTIVE}


def play(
    trials: Sequence[Trial],
    variant: Variant,
    *,
    seconds: float,
    progress: Callable[[int], None] = lambda _done: None,
    chunk: int = 100,
    over: Over = here,
) -> Verdicts:
    """Run and judge every trial under one variant.

    Args:
        trials: Rooms to be run.
        variant: Law and devices of everybody.
        seconds: Length of haptics per trial.
        progress: Called with the number of trials done, after each chunk.
        chunk: Trials that run side by side between two calls of `progress`.
        over: Machines on which chunks run.
    """
    chunks = [trials[start : start + chunk] for start in range(0, len(trials), chunk)]
    run = partial(_run, variant=variant, seconds=seconds, tail=TAIL)
    parts: list[tuple[Floats, Floats, Floats]] = []
    for some, part in zip(chunks, over(run, chunks), strict=True):
        parts.append(part)
        progress(len(some))
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
    count, limit = len(trials), MAX_USERS
    C = np.zeros((count, 3 * limit, 3 * limit))
    hands, devices, motions, links, gains = (
        np.zeros((count, limit, columns)) for columns in (5, 3, 9, 4, 2)
    )
    lags, fractions = np.zeros(count), np.zeros(count)
    S, roots = np.zeros((count, 3 * limit, 3 * limit)), np.ones((count, 3 * limit))
    for t, trial in enumerate(trials):
        n, none = len(trial.C), np.zeros(len(trial.C))
        C[t, : 3 * n, : 3 * n] = trial.blocks
        lags[t], plan = lag_of(trial, variant)
        fractions[t] = plan.fraction
        S[t, : 3 * n, : 3 * n], roots[t, : 3 * n] = plan.S, plan.root
        hands[t, :n] = np.stack(
            [trial.mass, trial.damping, trial.stiffness, trial.depth, trial.press_at], axis=1
        )
        gains[t, :n] = [(g.k_h, g.integral_gain) for g in gains_of(trial, variant)]
        friction = none if trial.friction is None else trial.friction
        stiffest = gains[t, :n, 0] if trial.max_stiffness is None else trial.max_stiffness
        devices[t, :n] = np.stack([variant.budgets(trial), friction, stiffest], axis=1)
        motions[t, :n] = trial.motion
        loss = none if trial.loss is None else trial.loss
        links[t, :n] = np.stack([trial.up, trial.down, trial.jitter, loss], axis=1)
    tails = np.zeros((count, round(min(tail, seconds) / T) // EVERY, limit))
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
        S,
        roots,
        fractions,
        np.array([trial.simulation_period for trial in trials]),
        np.array([trial.seed for trial in trials]),
        seconds,
        tails,
        figures,
    )
    return tails, figures, lags
