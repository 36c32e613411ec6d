from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic.control.law import Law
from cohaptic.control.laws.model import Gains
from cohaptic.control.stability.anticipation import UNCOUPLED, anticipated
from cohaptic_server.numeric import Floats, Mask
from cohaptic_server.world.lags.planning import (
    MAX_ANSWERED,
    MAX_TURNED,
    Planned,
    find_anticipation,
    known_coupling,
)
from cohaptic_server.world.lags.room_loop import hand_stiffness, room_loop
from cohaptic_server.world.lags.turning import Turned
from cohaptic_server.world.state import NOTHING, UserState
from tests.server.touches import changed, touch, user_of
from tests.server.world.lags.lag_rooms import DT, Room, everybody, room_coupling, rooms

UP = np.array([0.0, 0.0, 1.0])


def plan_of(
    users: list[UserState], C: Floats, where: list[slice], pressing: Mask, *, known: bool = True
) -> Planned:
    normals, loop = np.tile(UP, (len(users), 1)), room_loop(users, C, where, pressing, DT)
    S = known_coupling(loop, None) if known else None
    return find_anticipation(loop, normals, S, None, DT)


def answering(users: list[UserState]) -> list[UserState]:
    """Users whose samples answer a patch."""
    return [replace(user, touch=replace(user.touch, tick=3)) for user in users]


@given(rooms(2))
def test_it_anticipates_those_who_press(room: Room) -> None:
    users, C, where, pressing = room
    found = plan_of(answering(users), C, where, pressing)
    assert found.m == pytest.approx(room_coupling(users, C, where, pressing), abs=1e-12)
    whole = anticipated(room_loop(users, C, where, pressing, DT).S)
    assert found.gains == whole.gains
    here = np.flatnonzero(pressing)
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
    users, C, where, pressing = room
    pressing[:] = True
    found = plan_of(answering(users), C, where, pressing)
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
def test_a_law_of_the_paper_or_an_unknown_coupling_leaves_the_room_as_it_was(
    room: Room, data: st.DataObject
) -> None:
    users, C, where, pressing = room
    pressing[:] = True
    i = data.draw(st.integers(0, len(users) - 1))
    paper_laws = [*users]
    paper_laws[i] = replace(users[i], touch=changed(users[i].touch, law=Law.PROPORTIONAL))
    for found in (
        plan_of(answering(paper_laws), C, where, pressing),
        plan_of(answering(users), C, where, pressing, known=False),
    ):
        assert found.anticipation is NOTHING
        assert found.gains is None
    # The law of a user who does not press does not matter.
    pressing[i] = False
    assert plan_of(answering(paper_laws), C, where, pressing).gains is not None


def test_gains_of_a_users_own_choice_may_be_too_stiff_for_any_delay() -> None:
    """K C_ii = 8: an eigenvalue of S is below -1, and nothing is proved."""
    C = 0.004 * np.array([[1.0, 0.5], [0.5, 1.0]])
    where = [slice(0, 1), slice(1, 2)]
    users = [user_of(touch(i, tick=2, fixed_gains=Gains(2000.0, 0.0))) for i in (1, 2)]
    assert plan_of(users, C, where, everybody(2)).gains is None
    usual = [user_of(touch(i, tick=2)) for i in (1, 2)]
    assert plan_of(usual, C, where, everybody(2)).gains is not None


def test_who_has_not_answered_a_patch_yet_is_not_anticipated() -> None:
    C = 0.004 * np.array([[1.0, 0.5], [0.5, 1.0]])
    where = [slice(0, 1), slice(1, 2)]
    users = [user_of(touch(1, tick=2)), user_of(touch(2, tick=0))]
    found = plan_of(users, C, where, everybody(2))
    assert found.anticipation is NOTHING
    assert found.gains is not None
    assert found.gains != UNCOUPLED


# Contacts that others turn


def turned_pair(along: float, slide: float) -> tuple[list[UserState], Floats, Turned]:
    """Two hands, C between them, and how each turns the other, by S_pt and S_tt."""
    C = 0.004 * np.array([[1.0, 0.5], [0.5, 1.0]])
    users = [user_of(touch(i, tick=2, max_stiffness=1e4)) for i in (1, 2)]
    S = np.zeros((6, 6))
    S[0, 1] = S[1, 0] = 0.5
    S[0, 4] = S[4, 0] = S[1, 2] = S[2, 1] = along
    S[2, 4] = S[4, 2] = slide
    return users, C, Turned(S, 4)


def test_turned_contacts_are_anticipated_with_what_they_answer() -> None:
    users, C, turned = turned_pair(0.6, 0.3)
    loop = room_loop(users, C, [slice(0, 1), slice(1, 2)], everybody(2), DT)
    S = known_coupling(loop, turned)
    assert S is not None
    assert pytest.approx(loop.S + turned.answer()) == S
    found = find_anticipation(loop, np.tile(UP, (2, 1)), S, turned, DT)
    assert found.gains == anticipated(S).gains
    assert found.late == turned.late(anticipated(S).solve, DT) > 0.0
    # A hand's own press comes back to it by the contact that it has turned.
    assert found.anticipation.part.diagonal().min() > 0.1


@pytest.mark.parametrize("slide", [MAX_TURNED + 1e-6, 1.0, 3.0])
def test_contacts_that_are_about_to_slide_off_are_not_known(slide: float) -> None:
    users, C, turned = turned_pair(0.5, slide)
    loop = room_loop(users, C, [slice(0, 1), slice(1, 2)], everybody(2), DT)
    assert known_coupling(loop, turned) is None
    assert known_coupling(loop, turned_pair(0.5, MAX_TURNED - 1e-6)[2]) is not None


@pytest.mark.parametrize("slide", [0.0, 0.3, -0.5])
def test_contacts_that_answer_more_by_turning_than_they_are_given_are_not_known(
    slide: float,
) -> None:
    """The gain of a contact as deep as the surface is curved has no bound, and is not known."""
    limit = math.sqrt(MAX_ANSWERED * (1.0 - abs(slide)))
    users, C, turned = turned_pair(1.001 * limit, slide)
    loop = room_loop(users, C, [slice(0, 1), slice(1, 2)], everybody(2), DT)
    assert known_coupling(loop, turned) is None
    assert known_coupling(loop, turned_pair(0.999 * limit, slide)[2]) is not None


@pytest.mark.parametrize("back", [0.5, 0.6, MAX_TURNED])
def test_three_round_a_limb_that_turn_each_other_to_and_fro_are_not_known(back: float) -> None:
    """Each is turned the way that the other two are not: eigenvalues of -2 and twice 1, by `back`.

    Two of them are within the bound, and the third way is where the turning of a tick later grows.
    """
    C = 0.004 * (np.full((3, 3), 0.2) + 0.8 * np.eye(3))
    users = [user_of(touch(i, tick=2, max_stiffness=1e4)) for i in (1, 2, 3)]
    loop = room_loop(users, C, [slice(i, i + 1) for i in range(3)], everybody(3), DT)
    S = np.zeros((9, 9))
    S[:3, :3] = loop.S
    across = [3, 5, 7]  # the tangent of each that lies across the limb
    S[np.ix_(across, across)] = -back * (np.ones((3, 3)) - np.eye(3))
    assert known_coupling(loop, Turned(S, 6)) is None
    S[np.ix_(across, across)] *= 0.49 * MAX_TURNED / back
    assert known_coupling(loop, Turned(S, 6)) is not None
