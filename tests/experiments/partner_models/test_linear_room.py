"""Linear rooms: the truth behind delays, rooms that swing up and die again, and the small gain."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from cohaptic_experiments.partner_models.ensemble import (
    PRESS,
    compliance,
    draw,
)
from cohaptic_experiments.partner_models.linear_room import Rooms, Way, play, truth
from cohaptic_experiments.partner_models.loop_gain import loops, radius
from cohaptic_server.numeric import Floats

FINE = np.geomspace(0.3, 90.0, 1500)  # Hz


def press(seconds: float, n: int, rooms: int = 1) -> Floats:
    """The first hand presses, all others rest [m]."""
    t = 0.001 * np.arange(round(1000 * seconds))[:, None, None]
    return np.asarray(PRESS * np.clip((t - 0.5) / 0.02, 0.0, 1.0) * (np.arange(n) == 0)
                      * np.ones((1, rooms, 1)))  # fmt: skip


def rooms_with(hands: Floats, wanted: Floats, delay: float) -> Rooms:
    R, n, _ = hands.shape
    return Rooms(hands, compliance(R, n), wanted, np.full((R, n), delay), tick=0.01)


def test_with_right_models_a_press_is_the_truth_but_late() -> None:
    hands = np.array([[[0.2, 4.0, 300.0], [0.1, 6.0, 800.0]]])
    rooms = rooms_with(hands, press(2.0, 2), 0.1)
    felt, true = play(rooms, Way(hands)).force[:, 0, 1], truth(rooms)[:, 0, 1]
    # Both ways, up to two ticks, and the periods of clients and server.
    errors = [np.abs(felt[late:] - true[:-late]).max() for late in range(200, 226)]
    assert min(errors) < 0.04 * np.ptp(true)


@given(st.integers(0, 10_000), st.integers(2, 3))
@settings(max_examples=4, deadline=None)
def test_rooms_with_a_small_gain_do_not_grow(seed: int, n: int) -> None:
    rng = np.random.default_rng(seed)
    hands = draw(rng, 40, n)
    models = hands * np.exp(rng.uniform(-0.8, 0.8, hands.shape))
    C = compliance(40, n)
    gain = radius(loops(C, hands, models, FINE)).max(axis=1)
    # The few that are nearest to the bound.
    chosen = np.argsort(np.where(gain < 0.95, -gain, 0.0))[:8]
    delays = rng.uniform(0.0, 0.1, (8, n))
    rooms = Rooms(hands[chosen], C[chosen], press(9.0, n, 8), delays, tick=0.005)
    force = play(rooms, Way(models[chosen])).force
    early, late = (np.ptp(force[a:b], axis=0).max(axis=1) for a, b in ((1500, 3500), (7000, 9000)))
    assert (late < np.maximum(0.9 * early, 1e-4)).all()
