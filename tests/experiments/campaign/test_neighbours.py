"""The table of the campaign's rooms that the page has is what its command makes."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cohaptic.control.law import Law
from cohaptic_experiments.campaign.neighbours import (
    RULES,
    Outcome,
    coupling,
    draw_near,
    table,
)
from cohaptic_experiments.campaign.variants import Variant, lag_of

FILE = Path(__file__).parents[3] / "web/src/control/campaign_rooms.json"
FEW = 12  # rooms of each variant that are run anew
COLUMNS = len(Outcome._fields)


@pytest.fixture(scope="module")
def written() -> dict[str, Any]:
    found: dict[str, Any] = json.loads(FILE.read_text())
    return found


@pytest.mark.night
def test_its_first_rooms_are_those_of_today(written: dict[str, Any]) -> None:
    """Whoever changes a law, a lag or the ensemble makes the table anew: the file says how."""
    for rule, rows in table(0, FEW).items():
        variants = len(RULES[rule])
        for made, kept in zip(rows, written["outcomes"][rule], strict=True):
            # Each variant has its rooms one after the other, in the order of the trials.
            ours = np.array(made, dtype=int).reshape(variants, -1, COLUMNS)
            theirs = np.array(kept, dtype=int).reshape(variants, -1, COLUMNS)
            theirs = theirs[:, : ours.shape[1]]
            assert (ours[..., 3] == theirs[..., 3]).all(), rule
            # A last digit may be rounded the other way on another processor.
            assert np.abs(ours - theirs).max(initial=0) <= 1, rule


def test_the_coupling_is_the_one_by_which_the_lag_is_chosen() -> None:
    for index in range(20):
        trial = draw_near(1, index)
        _, plan = lag_of(trial, Variant(Law.PREDICTIVE))
        radius = np.abs(np.linalg.eigvalsh(plan.S)).max() if len(trial.C) > 1 else 0.0
        assert coupling(trial, Variant(Law.PREDICTIVE)) == pytest.approx(radius)
        if len(trial.C) > 1:
            # Gershgorin: gains that respect the others keep a room of the paper's laws within 1.
            assert coupling(trial, Variant(Law.PROPORTIONAL)) <= 1.0 + 1e-9
            assert coupling(trial, Variant(Law.PROPORTIONAL, coupled=False)) >= 0.9 - 1e-9
