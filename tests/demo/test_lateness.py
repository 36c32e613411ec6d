from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic_server.numeric import Floats
from cohaptic_tools.demo.analysis import STEP
from cohaptic_tools.demo.lateness import LEAST, felt_delay, half_change

SECONDS, PRESS, RAMP = (
    3.0,
    0.8,
    0.3,
)  # s; of a window, when the change begins, and how long it takes
FINE: Floats = np.asarray(STEP * np.arange(round(SECONDS / STEP)), dtype=np.float64)
COARSE: Floats = FINE[::10]


def press(t: Floats, late: float = 0.0, size: float = 2.0, start: float = 1.0) -> Floats:
    """A force that rises smoothly, and the same that comes late."""
    s = np.clip((t - PRESS - late) / RAMP, 0.0, 1.0)
    return np.asarray(start + size * s * s * (3.0 - 2.0 * s))


sizes = st.floats(0.1, 8.0) | st.floats(-8.0, -0.1)


@given(st.floats(0.0, 1.2), sizes, sizes, st.integers(0, 2**32 - 1), st.floats(0.0, 0.02))
def test_a_known_delay_is_found_whatever_is_lost_of_the_force(
    late: float, felt: float, at_once: float, seed: int, noise: float
) -> None:
    """A law may give a tenth of the force, and a device may tremble: it is late by the same."""
    noisy = noise * abs(felt) * np.random.default_rng(seed).normal(size=len(FINE))
    found = felt_delay(FINE, press(FINE, late, felt) + noisy, COARSE, press(COARSE, 0.0, at_once))
    # Noise of 2 % of a change that takes 0.3 s, averaged over 11 periods.
    assert found == pytest.approx(late, abs=0.0005 + 0.3 * noise)


@given(st.floats(0.05, 0.6))
def test_a_force_that_creeps_is_as_late_as_half_of_it(time: float) -> None:
    """A step that comes with a time constant: its half comes after ln 2 of it."""
    step = np.where(FINE < PRESS, 0.0, 1.0 - np.exp(-(FINE - PRESS) / time))
    at_once = np.where(FINE < PRESS, 0.0, 1.0)
    whole = 1.0 - math.exp(-(SECONDS - PRESS) / time)  # that it comes to within the window
    expected = -time * math.log(1.0 - 0.5 * whole)
    # The last 0.2 s are averaged, in which a slow one still moves.
    assert felt_delay(FINE, step, FINE, at_once) == pytest.approx(expected, rel=0.06, abs=0.006)


def test_the_surface_may_be_there_long_before_the_force() -> None:
    """As with an integral law: what counts is what the hand has of it."""
    displacement, force = press(FINE, 0.19), press(FINE, 0.48)
    assert felt_delay(FINE, displacement, COARSE, press(COARSE)) == pytest.approx(0.19, abs=1e-3)
    assert felt_delay(FINE, force, COARSE, press(COARSE)) == pytest.approx(0.48, abs=1e-3)


def test_a_half_is_found_between_two_readings() -> None:
    t = np.array([0.0, 0.1, 0.2, 1.0, 1.1, 1.2, 1.3])
    force = np.array([0.0, 0.0, 0.0, 0.4, 0.6, 1.0, 1.0])
    # The mean of the end is 1 N in the last 0.2 s but for one reading of 0.6 N.
    half = 0.5 * (0.6 + 1.0 + 1.0) / 3.0
    assert half_change(t, force) == pytest.approx(1.0 + 0.1 * (half - 0.4) / 0.2)


@pytest.mark.parametrize("size", [0.0, 0.9 * LEAST, -0.9 * LEAST])
def test_what_is_not_felt_is_not_late(size: float) -> None:
    assert math.isnan(half_change(FINE, press(FINE, size=size)))
    assert math.isnan(felt_delay(FINE, press(FINE, size=size), COARSE, press(COARSE)))
    assert math.isnan(felt_delay(FINE, press(FINE), COARSE, press(COARSE, size=size)))


def test_a_force_that_is_no_number_is_not_late() -> None:
    assert math.isnan(half_change(FINE, np.full_like(FINE, np.nan)))
