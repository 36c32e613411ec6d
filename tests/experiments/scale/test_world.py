"""What the simulated day of a cluster must get right, whatever its numbers are."""

from __future__ import annotations

import numpy as np
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


def test_a_machine_uses_what_its_rooms_and_people_take(lived: World) -> None:
    costs = lived.costs
    for k, machine in enumerate(lived.machines):
        assert machine.rooms == set(np.flatnonzero(lived.owner == k).tolist())
        people = sum(int(lived.people[room]) for room in machine.rooms)
        taken = costs.room * len(machine.rooms) + costs.person * people
        assert machine.used == pytest.approx(taken, abs=1e-9)
        assert machine.there or not machine.rooms


def test_everybody_is_in_a_room_that_runs_and_no_room_is_overfull(lived: World) -> None:
    assert lived.people.min() >= 0
    assert lived.people.max() <= SMALL.seats
    assert (lived.owner[lived.people > 0] >= 0).all()


def test_nobody_comes_back_before_others_may_have_the_room(lived: World) -> None:
    costs, silent = lived.costs, lived.record.silences
    assert len(silent["failure"]) > 20
    assert len(silent["update"]) > 20
    assert min(silent["failure"]) >= costs.term + costs.asked + costs.opening
    assert min(silent["update"]) >= costs.told[0] + costs.opening


def test_who_comes_just_after_the_head_is_gone_waits_for_the_witnesses() -> None:
    begin, alone = 12.0 * 3600.0, 600.0  # they take 3 s, in which hardly anybody comes
    for gone in (0.0, 1800.0):
        plan = Plan(rooms=60, machines=6, people=50.0, head_gone=(begin, gone), joins=0, seed=3)
        waits = World(plan, Costs(alone=alone)).run(lambda _: None).waits
        assert (max(waits) > 0.5 * alone) == (gone > 0.0)
        assert max(waits) < alone + 5.0
        assert np.median(waits) < 2.0


def test_a_cluster_without_processors_turns_people_away() -> None:
    plan = Plan(rooms=60, machines=1, cores=1, people=200.0, joins=0, at_once=1, seed=3)
    world = World(plan, Costs())
    record = world.run(lambda _: None)
    assert 0 < record.refused < record.joined
    assert world.people.min() >= 0
