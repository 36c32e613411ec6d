"""The times of a press, from changes of force that are known."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic_experiments.transparency.press import SETTLED, delayed, press_of
from cohaptic_experiments.virtual_session import PERIOD
from cohaptic_server.numeric import Floats

BEFORE, AFTER = 300, 3000  # periods


def change(delay: float, tau: float, size: float) -> Floats:
    """A step that comes `delay` after the press, with a time constant."""
    t = PERIOD * (np.arange(BEFORE + AFTER) - BEFORE)
    return np.where(t < delay, 0.0, size * (1.0 - np.exp(-(t - delay).clip(0.0) / tau)))


sizes = st.floats(0.05, 3.0) | st.floats(-3.0, -0.05)


@given(st.floats(0.0, 1.0), st.floats(0.03, 0.2), sizes)
def test_a_press_is_as_late_as_it_comes(delay: float, tau: float, size: float) -> None:
    felt, true = (press_of(change(d, tau, size), BEFORE) for d in (delay, 0.0))
    found = delayed(felt, true)
    assert found.late == pytest.approx([delay] * 3, abs=2.0 * PERIOD)
    assert found.change == pytest.approx(size, rel=1e-3)
    assert found.true_change == pytest.approx(size, rel=1e-3)
    assert found.settled == pytest.approx(delay - tau * math.log(SETTLED), abs=0.01)
