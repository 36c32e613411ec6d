"""What is read off a room of users who press at once; `test_experiments.py` runs the experiment."""

from __future__ import annotations

import math

import numpy as np
import pytest

from cohaptic.control.law import Law
from cohaptic_client.loop.safety import EXTERNAL_RATE
from cohaptic_experiments.users.ring import APPROACH, REACHED, play, reached
from cohaptic_experiments.virtual_session import PERIOD
from cohaptic_server.bodies.balloon.balloon import Balloon, BalloonSettings


def test_a_force_outside_the_tolerance_in_the_end_never_settles() -> None:
    assert reached(np.full(3000, 2.0 * REACHED)) == math.inf
    assert reached(np.zeros(3000)) == 0.0


@pytest.fixture(scope="module")
def body() -> Balloon:
    return Balloon(BalloonSettings(subdivisions=2, contact_radius=0.03))


def test_a_room_is_measured_against_the_equilibrium(body: Balloon) -> None:
    """Two users: the predictive law reaches the reference, and the proportional one never does."""
    exact, soft = (play(body, law, 2, 4.0, 0) for law in (Law.PREDICTIVE, Law.PROPORTIONAL))
    assert exact.error < 0.01 < soft.error
    assert exact.reached < 2.0
    assert soft.reached == math.inf
    for played in (exact, soft):
        assert played.furthest[0] == 1.0  # nobody touches yet
        assert played.t[-1] == pytest.approx(4.0 - APPROACH)
        assert 0.0 < played.step < EXTERNAL_RATE * PERIOD + 1e-6
    assert exact.furthest[-1] < REACHED
