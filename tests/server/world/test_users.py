"""Users as arrays: each gets what it would get whoever else is in them, and in whatever row."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from cohaptic.compiled import is_complete
from cohaptic.control.law import Law
from cohaptic.protocol.patch import Geometry, Patch
from cohaptic.vec import Vec3
from cohaptic_server.bodies.balloon.balloon import Balloon
from cohaptic_server.bodies.touched_body import TouchedBody
from cohaptic_server.world import contact_tracking, patch_geometry
from cohaptic_server.world.tick import advance
from cohaptic_server.world.users import WorldState
from tests.server.touches import side, touch
from tests.server.world.rooms import DT, TICKS, mixed_room, numbers

NONE = (math.nan, math.nan, math.nan)


def same(one: Patch, other: Patch) -> bool:
    return numbers(one) == pytest.approx(numbers(other), rel=1e-6, abs=1e-9)


def test_the_order_in_which_users_come_changes_nothing(small_balloon: Balloon) -> None:
    for (_, one), (_, other) in zip(
        mixed_room(small_balloon, TICKS),
        mixed_room(small_balloon, TICKS, backwards=True),
        strict=True,
    ):
        assert one.keys() == other.keys()
        assert all(same(one[user], other[user]) for user in one)


def test_arrays_that_turn_out_too_short_change_nothing(small_balloon: Balloon) -> None:
    """The loop stops at the user who has no room, and goes on with longer arrays."""
    usual = [found for _, found in mixed_room(small_balloon, TICKS)]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(contact_tracking, "_USUAL", 0)
        patch.setattr(patch_geometry, "_USUAL", 1)
        short = [found for _, found in mixed_room(small_balloon, TICKS)]
    for one, other in zip(usual, short, strict=True):
        assert one.keys() == other.keys()
        assert all(numbers(one[user]) == numbers(other[user]) for user in one)


def test_two_in_one_place_get_the_same_patch(small_balloon: Balloon) -> None:
    """And 64 too."""
    for count in (2, 64):
        body, state = TouchedBody(small_balloon), WorldState()
        found = dict[int, Patch]()
        for k in range(8):
            everybody = [
                touch(user, force=0.5, tick=k, seq=k, t_client=k * DT, geometry=Geometry.MESH)
                for user in range(1, count + 1)
            ]
            state, found = advance(body, state, everybody, now=k * DT, dt=DT)
        first = found[1]
        assert all(same(first, patch) for patch in found.values())
        assert all(patch.neighbourhood == first.neighbourhood for patch in found.values())
        first.encode()


def test_each_gets_the_gains_of_its_own_law(small_balloon: Balloon) -> None:
    """Users with different laws far apart, against rooms in which all have the law of one."""
    laws = tuple(Law)

    def room(chosen: tuple[Law, ...]) -> dict[int, Patch]:
        body, state, found = TouchedBody(small_balloon), WorldState(), dict[int, Patch]()
        for k in range(8):
            here = [
                touch(i + 1, at=side(2.1 * i), law=law, tick=k, t_client=k * DT)
                for i, law in enumerate(chosen)
            ]
            state, found = advance(body, state, here, now=k * DT, dt=DT)
        return found

    mixed = room(laws)
    for i, law in enumerate(laws):
        alike = room((law,) * len(laws))[i + 1]
        assert mixed[i + 1].law is law
        assert mixed[i + 1].k_h == pytest.approx(alike.k_h, rel=0.05)
        assert (mixed[i + 1].integral_gain > 0.0) == (law is Law.PI)


@pytest.mark.parametrize("tip", [NONE, (math.inf, 0.0, 0.0), (0.1, math.nan, 0.0), (10.0,) * 3])
@pytest.mark.parametrize("force", [NONE, (0.0, 0.0, 100.0)])
def test_a_tip_that_is_nowhere_costs_its_user_alone(
    small_balloon: Balloon, tip: Vec3, force: Vec3
) -> None:
    """The protocol lets none in; should one come, the others feel a hand that has gone."""
    body = TouchedBody(small_balloon)
    rooms = {"with": WorldState(), "without": WorldState()}
    found = dict[str, dict[int, Patch]]()
    for k in range(120):
        for name, state in rooms.items():
            here = [
                touch(1, tick=k, t_client=k * DT, geometry=Geometry.MESH),
                touch(2, at=side(1.0), tick=k, t_client=k * DT, geometry=Geometry.MESH),
            ]
            if k >= 20:
                bad = replace(here[1], probe=tip, force=force)
                here = [here[0], bad] if name == "with" else here[:1]
            # Kernels warn of it as plain Python only.
            with np.errstate(invalid="warn" if is_complete("kernels") else "ignore"):
                rooms[name], found[name] = advance(body, state, here, now=k * DT, dt=DT)
    first, alone = found["with"][1], found["without"][1]
    first.encode()
    assert rooms["with"].users[2].force == 0.0
    assert np.array(first.x_free) == pytest.approx(np.array(alone.x_free), abs=1e-5)
    assert np.array(first.own_force) == pytest.approx(np.array(alone.own_force), abs=1e-3)
