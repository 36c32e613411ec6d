from __future__ import annotations

import math

import numpy as np
import pytest

from cohaptic_experiments.paper.measure import settling_time, swing


def test_settling_time_of_a_decay() -> None:
    t = np.arange(0.0, 10.0, 0.001)
    x = 1.0 - np.exp(-np.maximum(0.0, t - 1.0) / 0.5)
    assert settling_time(t, x, 1.0, 0.02) == pytest.approx(0.5 * math.log(50.0), abs=0.002)


def test_a_response_that_still_swings_has_not_settled() -> None:
    t = np.arange(0.0, 10.0, 0.001)
    assert settling_time(t, 1.0 + 0.1 * np.sin(20.0 * t), 1.0, 0.02) == math.inf
    assert swing(np.sin(20.0 * t)) == pytest.approx(2.0, rel=1e-3)
