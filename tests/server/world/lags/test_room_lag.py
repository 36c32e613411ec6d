from __future__ import annotations

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic.control.delay import TOO_LONG, LoopDelay
from cohaptic.control.law import Gains, Law
from cohaptic.control.room_lag import NO_LAG, RoomLag
from cohaptic.control.stability.lag_choice import FULL_BUDGET, choose_lag, lag_needed
from cohaptic.control.stability.room_roots import growth
from cohaptic.protocol.patch import check_room
from cohaptic_server.numeric import Floats
from cohaptic_server.world.lags.room_lag import FALL_RATE, find_lag, hand_stiffness, room_coupling
from cohaptic_server.world.state import UserState
from tests.server.touches import touch, user_of

DT = 1.0 / 60.0  # s
delays = st.floats(0.0, 1.0)
budgets = st.floats(0.0, 2.0 * FULL_BUDGET)
Room = tuple[list[UserState], Floats, list[slice], Floats]


@st.composite
def rooms(draw: st.DrawFn, least: int = 1, law: Law | None = Law.PREDICTIVE) -> Room:
    """Users, C of all their loads, which are whose, and how much each counts as a neighbour."""
    n: int = draw(st.integers(least, 6))
    rough = draw(st.lists(st.booleans(), min_size=n, max_size=n))
    ends: list[int] = np.cumsum([0] + [3 if r else 1 for r in rough]).tolist()
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    A = np.abs(rng.normal(size=(ends[-1], ends[-1] + 2))) + 0.5 * rng.normal(
        size=(ends[-1], ends[-1] + 2)
    )
    C = A @ A.T + 0.05 * np.eye(ends[-1])
    scale = 1.0 / np.sqrt(np.asarray(np.diag(C) * rng.uniform(50.0, 5000.0, ends[-1])))
    users = [
        user_of(
            touch(
                i + 1,
                law=law or draw(st.sampled_from(Law)),
                friction=rough[i],
                max_stiffness=draw(st.floats(100.0, 5000.0)),
                damping_budget=draw(budgets),
            ),
            delay=draw(st.none() | delays),
        )
        for i in range(n)
    ]
    near = np.array([draw(st.sampled_from([0.0, 0.3, 1.0])) for _ in range(n)])
    where = [slice(a, b) for a, b in itertools.pairwise(ends)]
    return users, C * np.outer(scale, scale), where, near


# Coupling


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


# The lag


@given(rooms())
def test_the_lag_is_chosen_for_the_slowest_loop_and_the_weakest_device_of_those_who_count(
    room: Room,
) -> None:
    users, C, where, near = room
    found = find_lag(users, C, where, near, NO_LAG, DT)
    count = [user for user, counts in zip(users, near.tolist(), strict=True) if counts > 0.0]
    # Nothing is known of a loop before its first sample; the ramp to a new patch is one period.
    longest = max([max(0.0, u.delay.recent) + DT for u in count], default=DT)
    budget = min([u.touch.damping_budget for u in count], default=math.inf)
    m = room_coupling(users, C, where, near)
    assert found == pytest.approx(choose_lag(m, longest, budget))


@given(rooms(2), st.floats(0.01, 0.5))
def test_hands_held_still_are_stable_with_it(room: Room, delay: float) -> None:
    """The theorem of science 3.8, by the roots of the room with everybody's own delay."""
    users, C, where, near = room
    near[:] = 1.0
    users = [
        replace(user, delay=LoopDelay().measured(delay * share, 0.0))
        for user, share in zip(users, np.linspace(0.2, 1.0, len(users)).tolist(), strict=True)
    ]
    found = find_lag(users, C, where, near, NO_LAG, DT)
    assert found.margin > 1.0
    K = [hand_stiffness(user, C[w, w]) for user, w in zip(users, where, strict=True)]
    root = np.zeros_like(C)
    for w, k in zip(where, K, strict=True):
        root[w, w] = np.linalg.cholesky(k)
    S = root.T @ C @ root
    for w in where:
        S[w, w] = 0.0
    each = np.repeat([user.delay.value + DT for user in users], [w.stop - w.start for w in where])
    assert growth(0.5 * (S + S.T), each, found.lag) < 0.0


@given(rooms(2), st.data())
def test_who_has_left_or_is_silent_closes_no_loop(room: Room, data: st.DataObject) -> None:
    users, C, where, near = room
    i = data.draw(st.integers(0, len(users) - 1))
    stale = [*users]
    stale[i] = replace(users[i], touch=replace(users[i].touch, fresh=False))
    off = near.copy()
    off[i] = 0.0
    assert find_lag(stale, C, where, near, NO_LAG, DT) == find_lag(users, C, where, off, NO_LAG, DT)


@given(rooms(2, law=None))
def test_the_papers_laws_need_none_among_themselves(room: Room) -> None:
    users, C, where, near = room
    papers = [
        replace(u, touch=replace(u.touch, law=Law.PROPORTIONAL))
        if u.touch.law is Law.PREDICTIVE
        else u
        for u in users
    ]
    assert find_lag(papers, C, where, near, NO_LAG, DT).lag == 0.0


@given(rooms(), st.floats(0.0, 10.0))
def test_it_rises_at_once_and_falls_slowly(room: Room, before: float) -> None:
    """What was still to come does not come all at once."""
    users, C, where, near = room
    chosen = find_lag(users, C, where, near, NO_LAG, DT)
    found = find_lag(users, C, where, near, RoomLag(before, 1.0, 1.0), DT)
    assert found.lag >= chosen.lag
    assert found.coupling == chosen.coupling
    if found.lag > chosen.lag:
        assert before - found.lag == pytest.approx(max(FALL_RATE, before) * DT)
    # And it is said how far the room is from the edge with the lag that it has.
    assert found.margin >= chosen.margin


def test_it_falls_to_what_is_needed() -> None:
    lag = RoomLag(2.0, 1.0, 1.0)
    for _ in range(math.ceil((1.0 + 1.0 / FALL_RATE) / DT)):
        lag = find_lag([], np.zeros((0, 0)), [], np.zeros(0), lag, DT)
    assert lag == NO_LAG


def test_the_worst_room_can_be_said_and_says_that_it_is_not_stable() -> None:
    """64 hands at one place on the slowest loops, one of them with gains of its own choice."""
    n = 64
    C = 0.02 * (np.ones((n, n)) + 1e-6 * np.eye(n))
    users = [user_of(touch(i + 1, max_stiffness=1e6, damping_budget=0.0)) for i in range(n)]
    users = [replace(u, delay=LoopDelay().measured(TOO_LONG, 0.0)) for u in users]
    where = [slice(i, i + 1) for i in range(n)]
    slow = find_lag(users, C, where, np.ones(n), NO_LAG, DT)
    check_room(slow, remote=False)
    assert slow.coupling == pytest.approx(n - 1, rel=1e-3)
    assert slow.margin == pytest.approx(slow.lag / lag_needed(slow.coupling, TOO_LONG + DT))
    assert slow.margin < 1.0
    fixed = [replace(u, touch=replace(u.touch, fixed_gains=Gains(1e6, 0.0))) for u in users]
    stiff = find_lag(fixed, C, where, np.ones(n), NO_LAG, DT)
    check_room(stiff, remote=False)
    assert stiff.margin < 1.0
