from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic.control.law import Gains, Law
from cohaptic.control.stability.anticipation import UNCOUPLED, anticipated
from cohaptic_server.numeric import Floats
from cohaptic_server.world.lags.anticipated import NOTHING
from cohaptic_server.world.lags.planning import Planned, find_anticipation
from cohaptic_server.world.lags.room_loop import hand_stiffness, room_loop
from cohaptic_server.world.state import UserState
from tests.server.touches import touch, user_of
from tests.server.world.lags.lag_rooms import DT, Room, room_coupling, rooms

UP = np.array([0.0, 0.0, 1.0])


def plan_of(
    users: list[UserState], C: Floats, where: list[slice], near: Floats, *, calm: bool = True
) -> Planned:
    normals = np.tile(UP, (len(users), 1))
    return find_anticipation(room_loop(users, C, where, near, DT), normals, calm)


def answering(users: list[UserState]) -> list[UserState]:
    """Users whose samples answer a patch."""
    return [replace(user, touch=replace(user.touch, tick=3)) for user in users]


@given(rooms(2))
def test_it_anticipates_those_who_touch_and_counts_all_who_may(room: Room) -> None:
    users, C, where, near = room
    found = plan_of(answering(users), C, where, near)
    assert found.m == pytest.approx(room_coupling(users, C, where, near), abs=1e-12)
    whole = anticipated(room_loop(users, C, where, near, DT).S)
    assert found.gains == whole.gains
    here = np.flatnonzero(near >= 1.0)
    if len(here) < 2:
        assert found.anticipation is NOTHING
        return
    plan = found.anticipation
    assert plan.users.tolist() == [users[i].touch.user for i in here.tolist()]
    assert len(plan.axes) == sum(where[i].stop - where[i].start for i in here.tolist())
    loads = len(plan.owner)
    assert pytest.approx(np.eye(loads), abs=1e-6) == plan.solve @ (np.eye(loads) + plan.part)


@given(rooms(2))
def test_what_is_left_is_what_a_hand_answers_beyond_it(room: Room) -> None:
    """In newton per newton: K C between the users less X leaves eigenvalues from -held to 0."""
    users, C, where, near = room
    near[:] = 1.0
    found = plan_of(answering(users), C, where, near)
    K_C = np.zeros_like(C)
    for user, w in zip(users, where, strict=True):
        K_C[w] = hand_stiffness(user, C[w, w]) @ C[w]
        K_C[w, w] = 0.0
    plan = found.anticipation
    left = np.linalg.eigvals(plan.solve @ (K_C - plan.part))
    assert np.abs(left.imag).max() < 1e-5
    assert left.real.max() < 1e-5
    assert found.gains is not None
    assert left.real.min() == pytest.approx(-found.gains.held, abs=1e-4)


@given(rooms(2), st.data())
def test_a_law_of_the_paper_or_a_steep_contact_leaves_the_room_as_it_was(
    room: Room, data: st.DataObject
) -> None:
    users, C, where, near = room
    near[:] = 1.0
    i = data.draw(st.integers(0, len(users) - 1))
    papers = [*users]
    papers[i] = replace(users[i], touch=replace(users[i].touch, law=Law.PROPORTIONAL))
    for found in (
        plan_of(answering(papers), C, where, near),
        plan_of(answering(users), C, where, near, calm=False),
    ):
        assert found.anticipation is NOTHING
        assert found.gains is None
    # The law of who is out of reach does not matter.
    near[i] = 0.0
    assert plan_of(answering(papers), C, where, near).gains is not None


def test_gains_of_a_users_own_choice_may_be_too_stiff_for_any_delay() -> None:
    """K C_ii = 8: an eigenvalue of S is below -1, and nothing is proved."""
    C = 0.004 * np.array([[1.0, 0.5], [0.5, 1.0]])
    where = [slice(0, 1), slice(1, 2)]
    users = [user_of(touch(i, tick=2, fixed_gains=Gains(2000.0, 0.0))) for i in (1, 2)]
    assert plan_of(users, C, where, np.ones(2)).gains is None
    usual = [user_of(touch(i, tick=2)) for i in (1, 2)]
    assert plan_of(usual, C, where, np.ones(2)).gains is not None


def test_who_has_not_answered_a_patch_yet_is_not_anticipated() -> None:
    C = 0.004 * np.array([[1.0, 0.5], [0.5, 1.0]])
    where = [slice(0, 1), slice(1, 2)]
    users = [user_of(touch(1, tick=2)), user_of(touch(2, tick=0))]
    found = plan_of(users, C, where, np.ones(2))
    assert found.anticipation is NOTHING
    assert found.gains is not None
    assert found.gains != UNCOUPLED


def test_one_who_is_alone_needs_nothing() -> None:
    found = plan_of([user_of(touch(1))], np.array([[0.004]]), [slice(0, 1)], np.ones(1))
    assert found == Planned(NOTHING, UNCOUPLED, 0.0)
