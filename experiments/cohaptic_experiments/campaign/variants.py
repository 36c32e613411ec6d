"""Law and devices of a room of the campaign, and the gains and lag that the server would choose."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from cohaptic.control.gains import ALPHA, choose_gains
from cohaptic.control.law import Law
from cohaptic.control.laws.model import Gains
from cohaptic.control.stability.anticipation import anticipated, lag_of_hands
from cohaptic_client.loop.passivity import MAX_DAMPING
from cohaptic_experiments.campaign.trials import Trial
from cohaptic_server.numeric import Floats

_NO_LIMIT = 1e6  # N/m; stiffness of a device that limits no gain


@dataclass(frozen=True, slots=True)
class Variant:
    """Law, rule for the gains, and damping of everybody in a room.

    Args:
        law: Local model.
        coupled: Whether gains respect the other contacts; False is the paper's rule, by C_ii alone.
        budget: Damping budget of every device [N s/m]; None for that of the trial, or `MAX_DAMPING`
            if it has none.
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
        """Name in tables."""
        if self.budget is None:
            return f"{self.rule} + passivity"
        return self.rule if self.budget == 0.0 else f"{self.rule} + {self.budget:g} N s/m"

    @property
    def without_passivity(self) -> Variant:
        """The same with the layer off."""
        return Variant(self.law, self.coupled, 0.0)

    def budgets(self, trial: Trial) -> Floats:
        """Damping budget of each device of a trial, shape (n,) [N s/m]."""
        if self.budget is not None:
            return np.full(len(trial.C), self.budget)
        return np.full(len(trial.C), MAX_DAMPING) if trial.budget is None else trial.budget


def gains_of(trial: Trial, variant: Variant) -> list[Gains]:
    """Gains that the server would choose for everybody of a trial."""
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


class Coupling(NamedTuple):
    """What the server would anticipate of a room.

    Args:
        S: S of three rows for each user, of which those along the surface are 0 without friction,
            shape (3 n, 3 n).
        root: Square roots of K in these rows, shape (3 n,).
        fraction: Share of the negative part that is anticipated; below 0 where nothing is.
    """

    S: Floats
    root: Floats
    fraction: float


def lag_of(trial: Trial, variant: Variant) -> tuple[float, Coupling]:
    """Lag that the server would choose while all hands press [s], and what it would anticipate.

    Both are nothing for the paper's laws.
    """
    n = len(trial.C)
    k = np.repeat(trial.gains, 3)
    # One share of the object's stiffness in all directions, of which the law has the normal's.
    own = np.diag(trial.blocks)
    root = np.sqrt(k * np.repeat(own[::3], 3) / own)
    if trial.friction is None or not trial.friction.any():
        root[1::3] = root[2::3] = 0.0
    S = trial.blocks * root[:, None] * root
    for i in range(n):
        S[3 * i : 3 * i + 3, 3 * i : 3 * i + 3] = 0.0
    root = np.maximum(root, 1e-9)
    if variant.law.answers_own_dent:
        return 0.0, Coupling(S, root, -1.0)
    gains = anticipated(S).gains
    stiffest = float((root * root).max())
    lag = lag_of_hands(gains, float(variant.budgets(trial).min()), stiffest)
    return lag, Coupling(S, root, 1.0 / (1.0 + gains.kappa))
