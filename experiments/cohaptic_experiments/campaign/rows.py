"""The rows of the campaign `hands`: ensembles of rooms, devices and durations (science 3.11)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from cohaptic.control.law import Law
from cohaptic_experiments.campaign.trials import Trial, draw
from cohaptic_experiments.campaign.variants import Variant
from cohaptic_experiments.campaign.wide_trials import draw_close, draw_stiff, draw_weak, draw_wide

SECONDS, LONG = 8.0, 40.0  # of haptics per trial
OURS = Variant(Law.PREDICTIVE)
OFF = OURS.without_passivity


@dataclass(frozen=True, slots=True)
class Row:
    """One row of the campaign.

    Args:
        name: Ensemble and damping of the devices, in words.
        draw: Makes a trial of the campaign's seed and an index.
        variant: Law and devices of everybody.
        seconds: Length of haptics per trial.
        times: Number of trials over the campaign's.
        unstable: Largest number of unstable trials that passes.
        error: Largest 95th percentile of a steady force's relative error; None if not judged.
    """

    name: str
    draw: Callable[[int, int], Trial]
    variant: Variant
    seconds: float
    times: int = 1
    unstable: int = 0
    error: float | None = None


def _wide(seed: int, index: int) -> Trial:
    return draw_wide(seed, index, LONG)


def _wide_on(budget: float) -> Variant:
    return Variant(Law.PREDICTIVE, budget=budget)


ROWS = (
    Row("as of science 3.4, 8 N s/m", draw, OURS, SECONDS, error=0.035),
    Row("as of science 3.4, layer off", draw, OFF, SECONDS, error=0.035),
    Row("the same after 40 s, 8 N s/m", draw, OURS, LONG, error=0.01),
    Row("the same after 40 s, layer off", draw, OFF, LONG, error=0.01),
    Row("wide, each device its own", _wide, OURS, LONG, 2),
    Row("wide, all 8 N s/m", _wide, _wide_on(8.0), LONG, 2),
    Row("wide, all 1 N s/m", _wide, _wide_on(1.0), LONG, 2),
    Row("wide, all 0 N s/m", _wide, _wide_on(0.0), LONG, 2, unstable=4),
    Row("objects of 800-8,000 N/m on 2,000, 8 N s/m", draw_stiff, OURS, SECONDS),
    Row("objects of 800-8,000 N/m on 2,000, layer off", draw_stiff, OFF, SECONDS),
    Row("all fingers within 10 mm, 8 N s/m", draw_close, OURS, SECONDS),
    Row("all fingers within 10 mm, layer off", draw_close, OFF, SECONDS),
    Row("hands of 0.3-1.5 N s/m, 8 N s/m", draw_weak, OURS, SECONDS),
)
# A few rooms may swing: a hand of 0.5 kg with 0.3 N s/m alone already rings for seconds.
WEAK_OFF = Row("hands of 0.3-1.5 N s/m, layer off", draw_weak, OFF, LONG, unstable=4)
