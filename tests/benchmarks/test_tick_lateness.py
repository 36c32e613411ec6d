"""Ticks of a known lateness are told as that."""

from __future__ import annotations

import numpy as np
import pytest

from core_users import PERIOD
from tick_lateness import EARLY, lateness


def test_a_tick_that_is_late_and_one_that_is_left_out_are_told_and_the_others_are_in_time() -> None:
    ticks = [100.0 + k * PERIOD for k in range(300)]
    ticks[150] += 6e-3
    del ticks[200]
    late = lateness(ticks)
    assert len(late) == 300
    assert sorted(late)[-2:] == pytest.approx([6e-3, PERIOD], abs=EARLY)
    assert np.sort(late)[:-2].max() <= EARLY


def test_of_no_ticks_nothing_is_said_to_be_in_time() -> None:
    assert list(lateness([])) == [PERIOD]
    assert list(lateness([3.0])) == [PERIOD]
