"""Transparency over frequency: what is read off responses, and a coupling whose answer is known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic.simulated.delay_line import LinkSettings
from cohaptic_experiments.transparency.frequency import (
    FREQUENCIES,
    as_delays,
    measure,
    true_responses,
)
from cohaptic_experiments.transparency.product import Variant
from cohaptic_experiments.transparency.setting import Setting
from cohaptic_server.bodies.balloon.balloon import Balloon
from cohaptic_server.numeric import Floats

F: Floats = np.array(FREQUENCIES)


@given(st.floats(0.0, 0.9))
def test_a_delay_is_found_at_every_frequency(delay: float) -> None:
    """Beyond half a turn too, as the delay of the frequency before says which turn it is."""
    assert as_delays(F, np.exp(-2j * np.pi * F * delay)) == pytest.approx(delay, abs=1e-9)


@pytest.fixture(scope="module")
def balloon(small_balloon: Balloon) -> Balloon:
    return small_balloon


@pytest.mark.night
def test_without_lag_layer_and_delay_the_program_is_transparent(balloon: Balloon) -> None:
    """The program itself against the truth, which shares no code with its rooms and loops."""
    setting = Setting(balloon)
    truth = true_responses(setting)
    variant = Variant(layer=False, lag=0.0, hz=200.0)
    bare = measure(setting, setting.product(variant), truth)
    assert truth.explained_variance > 0.99
    assert bare.explained_variance > 0.9
    low = F <= 5.0
    # At 5 Hz the hand nears its resonance, which ticks of 5 ms make a little sharper.
    assert bare.weakest[low] == pytest.approx(1.0, abs=0.08)
    assert np.abs(bare.own[low]) == pytest.approx(1.0, abs=0.08)
    assert bare.bandwidth > 8.0
    far = replace(setting, link=LinkSettings(0.08))
    late = measure(far, far.product(variant), truth)
    # At 0.1 Hz everything is there, both ways and the further rounds later.
    assert late.weakest[0] == pytest.approx(1.0, abs=0.02)
    assert late.delays[0] > 0.16
    assert late.bandwidth < bare.bandwidth
