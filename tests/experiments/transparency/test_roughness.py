"""Roughness is that of the network: a delay alone has none, and what is added is found."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic.simulated.delay_line import LinkSettings
from cohaptic_experiments.transparency.product import Variant
from cohaptic_experiments.transparency.roughness import (
    changing_offset,
    measure_roughness,
    true_sway,
)
from cohaptic_experiments.transparency.setting import Setting
from cohaptic_experiments.virtual_session import PERIOD
from cohaptic_server.bodies.balloon.balloon import Balloon
from cohaptic_server.numeric import Floats


def sway(late: Floats | float) -> Floats:
    """A sway at 1 Hz, by so much later [s]."""
    t: Floats = PERIOD * np.arange(6000, dtype=np.float64)
    return 2.0 + np.asarray(0.25 * np.sin(2.0 * np.pi * (t - late)))


@given(st.integers(0, 160))
def test_a_constant_delay_is_found_and_does_not_vary(steps: int) -> None:
    offsets, value = changing_offset(sway(0.005 * steps), sway(0.0))
    assert offsets == pytest.approx(0.005 * steps, abs=0.006)
    assert value < 0.01


@pytest.mark.night
def test_jitter_and_late_ticks_are_felt_as_a_delay_alone(balloon: Balloon) -> None:
    """The claim of science 3.16, through the real room, frames and loops (issue figures)."""
    setting = Setting(balloon, link=LinkSettings(0.01, 0.01), late_ticks=0.25)
    (found,) = measure_roughness(
        setting, lambda: setting.product(Variant(models=True)), true_sway(setting)
    )
    assert found.fast <= 0.005
    assert found.path <= 1.25
    assert found.swing == pytest.approx(found.true_swing, rel=0.1)
    assert found.at_rest <= 0.02
    # Without models, whose force moves with the others' wishes, it is later.
    assert 0.02 <= found.late <= 0.15
