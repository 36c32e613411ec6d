from __future__ import annotations

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic.control.law import Gains, Law
from cohaptic_server.world.lags.room_loop import hand_stiffness, room_loop
from tests.server.touches import touch, user_of
from tests.server.world.lags.lag_rooms import DT, Room, room_coupling, rooms


@given(st.floats(10.0, 1e4), st.floats(10.0, 1e4), st.floats(-0.99, 0.99), st.floats(0.0, 1.0))
def test_two_users_are_coupled_by_what_each_makes_of_the_other(
    one: float, two: float, share: float, near: float
) -> None:
    """m = sqrt(K_1 K_2) |C_12|, and less of one who only approaches."""
    C = np.array([[0.004, share * 0.004], [share * 0.004, 0.004]])
    users = [user_of(touch(i, max_stiffness=k)) for i, k in enumerate((one, two), start=1)]
    k = math.sqrt(min(250.0, one) * min(250.0, two))
    where = [slice(0, 1), slice(1, 2)]
    found = room_coupling(users, C, where, np.array([1.0, near]))
    assert found == pytest.approx(k * 0.004 * abs(share) * math.sqrt(near), abs=1e-12)
    assert room_coupling(users[:1], C[:1, :1], where[:1], np.ones(1)) == 0.0


@given(rooms(2))
def test_the_stiffest_hand_counts_in_full_however_near_it_is(room: Room) -> None:
    """Of those who are near at all; with friction in its stiffest direction."""
    users, C, where, near = room
    expected = 0.0
    for user, span, weight in zip(users, where, near.tolist(), strict=True):
        if weight > 0.0:
            stiffness = np.linalg.eigvalsh(hand_stiffness(user, C[span, span]))[-1]
            # Who is only near may count less by how the tangents add to the normal's compliance.
            whole = 1.0 if weight >= 1.0 else 1.0 / (C[span, span][0, 0] * stiffness)
            expected = max(expected, float(stiffness) * min(1.0, whole))
    found = room_loop(users, C, where, near, DT).stiffest
    assert found >= 0.3 * expected if (near < 1.0).any() else found >= expected * (1.0 - 1e-9)
    lone = [i for i, span in enumerate(where) if span.stop - span.start == 1 and near[i] > 0.0]
    if lone and not any(user.touch.friction for user in users):
        limits = [min(users[i].touch.max_stiffness, 1.0 / C[i, i]) for i in lone]
        assert found == pytest.approx(max(limits))


def test_gains_of_ones_own_that_are_stiffer_than_the_body_count_as_stiff_as_they_are() -> None:
    C = np.array([[0.004, 0.0005], [0.0005, 0.004]])
    user = user_of(touch(1, fixed_gains=Gains(1000.0, 0.0)))
    users, where = [user, user_of(touch(2))], [slice(0, 1), slice(1, 2)]
    for near in (1.0, 0.5):
        loop = room_loop(users, C, where, np.array([near, 1.0]), DT)
        assert loop.stiffest == pytest.approx(1000.0)


def test_soft_hands_on_a_soft_body_are_as_soft_as_they_are() -> None:
    """With friction as well: no stiffness of the loop is made of nothing."""
    users = [user_of(touch(i, friction=True, max_stiffness=0.2)) for i in (1, 2)]
    C, where = 4.0 * np.eye(6), [slice(0, 3), slice(3, 6)]
    expected = np.linalg.eigvalsh(hand_stiffness(users[0], C[:3, :3]))[-1]
    assert expected < 0.5
    assert room_loop(users, C, where, np.ones(2), DT).stiffest == pytest.approx(expected)


@given(rooms(2), st.integers(0, 2**32 - 1))
def test_which_way_the_tangents_lie_does_not_matter(room: Room, seed: int) -> None:
    users, C, where, near = room
    turn = np.eye(len(C))
    angles = np.random.default_rng(seed).uniform(-3.0, 3.0, len(where))
    for span, a in zip(where, angles.tolist(), strict=True):
        if span.stop - span.start == 3:
            along = slice(span.start + 1, span.stop)
            turn[along, along] = [[math.cos(a), -math.sin(a)], [math.sin(a), math.cos(a)]]
    turned = room_coupling(users, turn @ C @ turn.T, where, near)
    assert turned == pytest.approx(room_coupling(users, C, where, near), rel=1e-9, abs=1e-9)


@given(rooms(2, law=None), st.data())
def test_who_is_out_of_reach_couples_with_nobody(room: Room, data: st.DataObject) -> None:
    """Whatever law it runs."""
    users, C, where, near = room
    away = data.draw(st.integers(0, len(users) - 1))
    near[away] = 0.0
    here = [i for i in range(len(users)) if i != away]
    rows = [row for i in here for row in range(where[i].start, where[i].stop)]
    ends = np.cumsum([0] + [where[i].stop - where[i].start for i in here]).tolist()
    without = room_coupling(
        [users[i] for i in here],
        C[np.ix_(rows, rows)],
        [slice(a, b) for a, b in itertools.pairwise(ends)],
        near[here],
    )
    if len(here) > 1:
        assert room_coupling(users, C, where, near) == pytest.approx(without, abs=1e-12)


@given(rooms(2, law=Law.PROPORTIONAL))
def test_the_papers_laws_are_coupled_with_their_own_dent_too(room: Room) -> None:
    """With the gains of the row rule, which bear any delay: at most 1 without friction."""
    users, C, where, near = room
    near[:] = 1.0
    others = [np.abs(C[w.start]).sum() - np.abs(C[w.start, w]).sum() for w in where]
    shares: list[float] = []
    for user, w, coupled in zip(users, where, others, strict=True):
        own = float(C[w.start, w.start])
        shares.append(own * min(user.touch.max_stiffness, 1.0 / (own + float(coupled))))
    found = room_coupling(users, C, where, near)
    assert found >= max(shares) * (1.0 - 1e-9)
    if len(C) == len(users):
        assert found <= 1.0 + 1e-9


@given(rooms(), st.data())
def test_a_hand_is_as_stiff_as_it_will_be_told(room: Room, data: st.DataObject) -> None:
    users, C, where, _ = room
    i = data.draw(st.integers(0, len(users) - 1))
    own, limit = C[where[i], where[i]], users[i].touch.max_stiffness
    K = hand_stiffness(users[i], own)
    # One share of the object's stiffness in all directions, of which the law has the normal's.
    share = min(1.0, limit * own[0, 0])
    assert pytest.approx(share * np.eye(len(own)), abs=1e-9) == K @ own
    # The paper's laws go by what the others do, too.
    others = data.draw(st.floats(0.0, 0.1))
    paper = replace(users[i], touch=replace(users[i].touch, law=Law.PI))
    share = min(limit, 1.0 / (own[0, 0] + others)) * own[0, 0]
    assert (
        pytest.approx(share * np.eye(len(own)), abs=1e-9)
        == hand_stiffness(paper, own, others) @ own
    )
    assert (hand_stiffness(users[i], own, others) == K).all()
    fixed = Gains(data.draw(st.floats(1.0, 1e5)), 0.0)
    told = replace(users[i], touch=replace(users[i].touch, fixed_gains=fixed))
    chosen: float = min(limit, fixed.k_h)
    share = chosen * float(own[0, 0])
    assert pytest.approx(share * np.eye(len(own)), abs=1e-6) == hand_stiffness(told, own) @ own
