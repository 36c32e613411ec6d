"""Rooms of the campaign as a table in which the page looks up those that are like its own.

The ensemble is that of science 3.4 (`trials.draw`) with links that are a random share of as long,
one share for a room, so that rooms in one building are among them too. Everybody in a room has
the same law and the same damping. Of each room the table has what a page knows of its own, and how
the room went.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Final, NamedTuple

import numpy as np

from cohaptic.control.law import Law
from cohaptic.control.stability.lag_choice import coupling_matrix, coupling_radius
from cohaptic_experiments.campaign.simulation import play
from cohaptic_experiments.campaign.trials import MAX_USERS, Trial, draw
from cohaptic_experiments.campaign.variants import Variant, gains_of
from cohaptic_experiments.campaign.verdicts import Verdicts

SECONDS: Final = 8.0  # of haptics per room, as in the campaign
# By the name of the rule for the gains, as the page has them: `alone` is the paper's own, by C_ii.
RULES: Final[Mapping[str, tuple[Variant, ...]]] = {
    "predictive": (Variant(Law.PREDICTIVE), Variant(Law.PREDICTIVE, budget=0.0)),
    "pi": (Variant(Law.PI),),
    "proportional": (Variant(Law.PROPORTIONAL),),
    "alone": (Variant(Law.PROPORTIONAL, coupled=False),),
}
LARGEST: Final = 9999  # of any number in the table


class Outcome(NamedTuple):
    """One room in whole numbers, as they stand in the table.

    Fields:
        delay: The longest loop of the room [ms].
        coupling: m of science 3.8 and 3.13, in hundredths.
        lag: Lag of the room [ms].
        unstable: 1 where forces keep swinging (`verdicts.judge`), else 0.
        swing: Swing of the last two seconds, in percent of the largest true force.
        error: Largest relative error of a steady force, in thousandths.
    """

    delay: int
    coupling: int
    lag: int
    unstable: int
    swing: int
    error: int


def draw_near(seed: int, index: int) -> Trial:
    """Trial `index` of the ensemble: that of science 3.4, with links a share of as long."""
    rng = np.random.default_rng([seed, index, 15])
    trial, fraction = draw(seed, index), rng.uniform(0.0, 1.0)
    return replace(
        trial, up=fraction * trial.up, down=fraction * trial.down, jitter=fraction * trial.jitter
    )


def coupling(trial: Trial, variant: Variant) -> float:
    """m of a room, as the server finds it (`world.lags.room_loop`), whatever its law."""
    if len(trial.C) < 2:
        return 0.0
    predictive = not variant.law.answers_own_dent
    own = np.diag(trial.C)
    if predictive:
        K = trial.gains
    elif variant.coupled:  # what the server sends is no stiffer
        K = 1.0 / np.abs(trial.C).sum(axis=1)
    else:
        K = np.minimum(1.0 / own, np.array([gains.k_h for gains in gains_of(trial, variant)]))
    S = coupling_matrix(trial.C, [np.array([[k]]) for k in K])
    # The paper's laws also respond to the dent of their own force.
    return coupling_radius(S if predictive else S + np.diag(K * own))


def outcomes(
    trials: Sequence[Trial], variant: Variant, progress: Callable[[int], None] = lambda _: None
) -> list[Outcome]:
    """Run rooms, and what the table has of each."""
    verdicts: Verdicts = play(trials, variant, seconds=SECONDS, progress=progress)
    return [
        Outcome(
            _whole(1e3 * float(trial.loop_delay.max())),
            _whole(1e2 * coupling(trial, variant)),
            _whole(1e3 * float(verdicts.lag[t])),
            int(verdicts.unstable[t]),
            _whole(1e2 * float(verdicts.swing[t])),
            _whole(1e3 * float(verdicts.error[t])),
        )
        for t, trial in enumerate(trials)
    ]


def table(
    seed: int, count: int, progress: Callable[[float], None] = lambda _: None
) -> dict[str, list[list[int]]]:
    """The rooms of each rule by their number of hands.

    Args:
        seed: Seed of the ensemble.
        count: Rooms of each variant; all variants have the same rooms.
        progress: Called with the share that is done.

    Returns:
        By the rule's name: for 1 to `MAX_USERS` hands one list, in which each room has the
        numbers of `Outcome` one after the other.
    """
    trials = [draw_near(seed, i) for i in range(count)]
    work, done = count * sum(len(variants) for variants in RULES.values()), 0

    def advance(more: int) -> None:
        nonlocal done
        done += more
        progress(done / work)

    found: dict[str, list[list[int]]] = {}
    for rule, variants in RULES.items():
        rows: list[list[int]] = [[] for _ in range(MAX_USERS)]
        for variant in variants:
            for trial, outcome in zip(trials, outcomes(trials, variant, advance), strict=True):
                rows[len(trial.C) - 1] += outcome
        found[rule] = rows
    return found


def _whole(x: float) -> int:
    return min(LARGEST, round(x))
