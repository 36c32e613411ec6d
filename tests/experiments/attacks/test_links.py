"""Honest hands whose links vary: what they do at rest."""

from __future__ import annotations

import pytest

from cohaptic_experiments.attacks.links import Room, still

RESTS = 0.05  # N


@pytest.mark.parametrize("seed", [1, pytest.param(2, marks=pytest.mark.night)])
def test_weak_hands_side_by_side_come_to_rest_though_their_delays_vary(seed: int) -> None:
    """With models they rattled without end, by 0.25 N and more."""
    room = Room("random", 2 + seed, "tap", close=True, seed=seed)
    assert still(room) <= max(RESTS, still(room, models=False))


@pytest.mark.night
def test_on_the_worst_links_of_all_models_add_nothing() -> None:
    room = Room("all", 4, "tap", close=True, seed=31009)
    assert still(room) <= max(RESTS, 1.05 * still(room, models=False))


@pytest.mark.night
@pytest.mark.parametrize("seed", [50631, 3])
def test_pauses_every_few_seconds_swing_no_room(seed: int) -> None:
    """A rule that forgave each pause by itself let three hands swing by 1.9 N."""
    room = Room("pauses", 3, "tremble", close=True, seed=seed)
    assert still(room) <= max(RESTS, 1.05 * still(room, models=False))
