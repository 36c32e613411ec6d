"""What the simulated day of a cluster must get right, whatever its numbers are."""

from __future__ import annotations

import pytest

from cohaptic_experiments.scale.world import DAY, Costs, Plan, World

SMALL = Plan(
    rooms=60, machines=6, people=50.0, between_failures=0.5 * DAY, joins=1, at_once=1, seed=3
)


@pytest.fixture(scope="module")
def lived() -> World:
    world = World(SMALL, Costs())
    world.run(lambda _: None)
    return world


def test_nobody_comes_back_before_others_may_have_the_room(lived: World) -> None:
    costs, silent = lived.costs, lived.record.silences
    assert len(silent["failure"]) > 20
    assert len(silent["update"]) > 20
    assert min(silent["failure"]) >= costs.term + costs.asked + costs.opening
    assert min(silent["update"]) >= costs.reported[0] + costs.opening
