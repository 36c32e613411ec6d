"""Transparency over frequency: what is read off responses, and a coupling whose answer is known."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic.simulated.delay_line import LinkSettings
from cohaptic_experiments.transparency.frequency import (
    FREQUENCIES,
    HALF_POWER,
    as_delays,
    falls_below,
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


@given(st.floats(0.002, 0.5))
def test_a_first_order_lag_falls_below_at_its_corner(tau: float) -> None:
    amplitude = np.abs(1.0 / (1.0 + 2j * np.pi * F * tau))
    corner = 1.0 / (2.0 * math.pi * tau)
    found = falls_below(F, amplitude, HALF_POWER)
    if corner < F[0]:
        assert found == F[0]
    elif corner > F[-1]:
        assert found == math.inf
    else:  # between two frequencies the slope changes
        assert found == pytest.approx(corner, rel=0.12)


@pytest.fixture(scope="module")
def balloon(small_balloon: Balloon) -> Balloon:
    return small_balloon


@pytest.mark.slow
def test_without_lag_layer_and_delay_the_program_is_transparent(balloon: Balloon) -> None:
    """The program itself against the truth, which shares no code with its rooms and loops."""
    setting = Setting(balloon)
    truth = true_responses(setting)
    variant = Variant(layer=False, lag=0.0, hz=200.0)
    bare = measure(setting, setting.product(variant), truth)
    assert truth.explained > 0.99
    assert bare.explained > 0.9
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
