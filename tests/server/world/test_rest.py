from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import nullcontext
from dataclasses import replace
from functools import partial

import pytest

from cohaptic.control.room_lag import RoomLag
from cohaptic.protocol.patch import Patch
from cohaptic_server.bodies.balloon.balloon import Balloon, BalloonSettings
from cohaptic_server.bodies.balloon.rubber_balloon import RubberBalloon
from cohaptic_server.bodies.body import Body
from cohaptic_server.bodies.touched_body import TouchedBody
from cohaptic_server.bodies.viscous import Viscous
from cohaptic_server.world import tick
from cohaptic_server.world.state import Touch
from cohaptic_server.world.users import REST_ENERGY, WorldState, is_at_rest, pass_over
from tests.server.bodies.modal.jelly import jelly
from tests.server.touches import touch
from tests.server.world.rooms import DT, TICKS, hands, numbers

COARSE = BalloonSettings(subdivisions=2, contact_radius=0.03)
LARGEST = 3000  # ticks
BODIES: dict[str, Callable[[], Body]] = {
    "linear": partial(Balloon, COARSE),
    "damped": partial(Balloon, COARSE, damping=2.0),
    "viscous": lambda: Viscous(Balloon(COARSE), 2.0),
    "rubber": partial(RubberBalloon, COARSE),
    "swings": jelly,
}


def on_top(body: Body) -> Touch:
    """A hand that presses where the body is highest."""
    x, y, z = body.mesh.vertices[int(body.mesh.vertices[:, 2].argmax())].tolist()
    return replace(touch(), probe=(x, y, z - 1e-3), force=(0.0, 0.0, 0.5))


def never(_state: WorldState) -> bool:
    return False


def as_it_is(state: WorldState, _now: float) -> WorldState:
    return state


class World:
    """One that is advanced tick by tick.

    Args:
        body: In it.
        made: Whether every tick is made, whatever is left of anybody.
    """

    def __init__(self, body: Body, *, made: bool = False) -> None:
        self.body, self.made = TouchedBody(body), made
        self.state = WorldState()

    def step(self, touches: Sequence[Touch]) -> dict[int, Patch]:
        now = (self.state.tick + 1) * DT
        with pytest.MonkeyPatch.context() if self.made else nullcontext() as patched:
            if patched is not None:
                patched.setattr(tick, "is_at_rest", never)
                patched.setattr(tick, "settled", as_it_is)
            self.state, found = tick.advance(self.body, self.state, touches, now=now, dt=DT)
        return found

    def leave_alone(self) -> None:
        for _ in range(LARGEST):
            if is_at_rest(self.state):
                return
            self.step([])
        raise AssertionError(f"it still moves after {LARGEST} ticks: {self.state.response}")


@pytest.mark.parametrize("name", BODIES)
def test_a_world_that_everybody_has_left_comes_to_rest_whatever_its_body(name: str) -> None:
    world = World(BODIES[name]())
    for _ in range(30):
        world.step([on_top(world.body.body)])
    assert not is_at_rest(world.state)
    world.leave_alone()
    before = world.state.tick
    assert world.step([]) == {}
    assert is_at_rest(world.state)
    assert (world.state.tick, world.state.room, world.state.past) == (before + 1, RoomLag(), ())


def test_what_can_still_be_felt_is_no_rest() -> None:
    world = World(Balloon(COARSE, damping=2.0))
    for _ in range(30):
        world.step([on_top(world.body.body)])
    seen: list[float] = []
    while not is_at_rest(world.state):
        assert world.state.response is not None
        seen.append(world.state.response.energy)
        world.step([])
    # A tick leaves 4/9 of an energy: the last that was no rest was just too large for one.
    assert REST_ENERGY < seen[-1] < 3.0 * REST_ENERGY


@pytest.mark.parametrize("slept", [0, 10**6])
def test_after_a_sleep_the_same_samples_get_the_same_forces(
    small_balloon: Balloon, slept: int
) -> None:
    """As in a room that ticks on, and as in one that makes every tick as if somebody were there.

    Seven hands of every kind: with friction, with jumps and absences, before the sleep and after.
    """
    body = small_balloon
    sleeps, wakes, works = World(body), World(body), World(body, made=True)
    worlds = (sleeps, wakes, works)
    for world in worlds:
        for number in range(TICKS):
            world.step(hands(number))
    sleeps.leave_alone()
    while wakes.state.tick < sleeps.state.tick + 60:
        wakes.step([])
    while works.state.tick < wakes.state.tick:
        works.step([])
    sleeps.state = pass_over(sleeps.state, 60)
    # The others cannot be asked to tick for hours: they are where they would be then.
    for world in worlds:
        world.state = replace(world.state, tick=world.state.tick + slept)
    before = sleeps.state.tick
    for number in range(TICKS):
        here = [replace(one, tick=one.tick and before + one.tick) for one in hands(number)]
        one, same, made = (world.step(here) for world in worlds)
        for user, patch in one.items():
            assert patch.encode() == same[user].encode()
            assert numbers(patch) == numbers(made[user])
            assert patch.own_force == made[user].own_force
