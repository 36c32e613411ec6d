"""Law and devices of a room of the campaign, and the gains and lag that the server would choose."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cohaptic.control.gains import ALPHA, choose_gains
from cohaptic.control.law import Gains, Law
from cohaptic.control.stability.lag_choice import choose_lag, coupling_matrix, coupling_radius
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


def lag_of(trial: Trial, variant: Variant) -> float:
    """Lag that the server would choose for the room [s]; 0 for the paper's laws."""
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
