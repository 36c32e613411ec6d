"""Servers that lie about the other hands, against a hand that has moved and now rests."""

from __future__ import annotations

import random
from functools import partial

import pytest

from cohaptic_client.loop.safety import BACKSTOP, EXTERNAL_RATE
from cohaptic_experiments.attacks import servers
from cohaptic_experiments.attacks.search import search
from cohaptic_experiments.attacks.victims import PERIOD

RUNS, ATTACK = 30, 120  # ms
STEP = BACKSTOP * EXTERNAL_RATE * PERIOD  # N
ROUNDING = 1e-9


@pytest.mark.parametrize("speed", [0.1, 0.5])
@pytest.mark.parametrize(
    ("device", "of"),
    [
        ((400.0, 3.3), 250.0),
        ((2000.0, 10.0), 250.0),
        ((2000.0, 10.0), 2000.0),
        ((8000.0, 12.0), 2000.0),
    ],
)
def test_after_30_ms_of_rest_nothing_of_a_motion_is_left_to_a_server(
    device: tuple[float, float], of: float, speed: float
) -> None:
    hand = servers.rested(device, of, speed, 30)
    play = partial(servers.attacked, hand, periods=ATTACK)
    worst = search(play, servers.draw, servers.alter, RUNS, random.Random(1))
    assert worst["step"].value <= STEP + ROUNDING
    assert worst["climb"].value <= 20 * STEP + ROUNDING
    assert worst["climb"].value > 0.5 * 20 * STEP  # it has a model to attack with
