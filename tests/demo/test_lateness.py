from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic_server.numeric import Floats
from cohaptic_tools.demo.analysis import STEP
from cohaptic_tools.demo.lateness import LEAST, LEVELS, late, passed

SECONDS, PRESS, RAMP = 3.0, 0.8, 0.3  # s; of a window, when the change begins, how long it takes
T: Floats = np.asarray(STEP * np.arange(round(SECONDS / STEP)), dtype=np.float64)


def press(late: float = 0.0, size: float = 2.0, start: float = 1.0) -> Floats:
    """A force that rises smoothly, and the same that comes late."""
    s = np.clip((T - PRESS - late) / RAMP, 0.0, 1.0)
    return np.asarray(start + size * s * s * (3.0 - 2.0 * s))


sizes = st.floats(0.1, 8.0) | st.floats(-8.0, -0.1)


@given(st.floats(0.0, 1.2), sizes, sizes, st.integers(0, 2**32 - 1), st.floats(0.0, 0.02))
def test_a_known_delay_is_found_whatever_is_lost_of_the_force(
    behind: float, felt: float, at_once: float, seed: int, noise: float
) -> None:
    """A law may give a tenth of the force, and a device may tremble: it is late by the same."""
    noisy = noise * abs(felt) * np.random.default_rng(seed).normal(size=len(T))
    found = late(passed(T, press(behind, felt) + noisy), passed(T, press(0.0, at_once)))
    # Noise of 2 % of a change that takes 0.3 s, averaged over 11 periods; it moves the times of
    # levels at the flat ends of the ramp most.
    assert found == pytest.approx([behind] * 3, abs=0.0005 + 2.0 * noise)
    assert found.onset <= found.half <= found.most


@given(st.floats(0.05, 0.4))
def test_a_force_that_creeps_passes_each_share_in_its_time(time: float) -> None:
    """A step that comes with a time constant: its half comes after ln 2 of it."""
    step = np.where(T < PRESS, 0.0, 1.0 - np.exp(-(T - PRESS) / time))
    for level, at in zip(LEVELS, passed(T, step), strict=True):
        # The last 0.2 s are averaged, in which a slow one still moves.
        expected = PRESS - time * math.log(1.0 - level)
        assert at == pytest.approx(expected, abs=0.006 + 0.05 * (expected - PRESS))


@given(st.floats(0.0, 0.6), st.floats(0.1, 1.0))
def test_who_overshoots_is_not_early_for_it(behind: float, more: float) -> None:
    """The answers of others come later: more than the change at first, and then the change.

    The force passes its own half before a force without an overshoot would, and nothing of it was
    there before it came.
    """
    overshoot = press(behind, 2.0 * (1.0 + more)) - press(behind + 0.5, 2.0 * more, 0.0)
    found, true = passed(T, overshoot), passed(T, press())
    assert found[4] - true[4] < behind
    # A tenth is passed early as well, by a part of the ramp's slow beginning.
    assert behind - 0.065 * RAMP <= late(found, true).half <= behind + 1e-3


@pytest.mark.parametrize("size", [0.0, 0.9 * LEAST, -0.9 * LEAST])
def test_what_is_not_felt_is_not_late(size: float) -> None:
    none, true = passed(T, press(size=size)), passed(T, press())
    assert np.isnan(none).all()
    assert all(map(math.isnan, late(none, true)))
    assert all(map(math.isnan, late(true, none)))
    assert not np.isnan(passed(T, press(size=0.9 * LEAST), least=0.5 * LEAST)).any()
