from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic.control.delay import TOO_LONG, LoopDelay
from cohaptic.control.laws.model import Gains
from cohaptic.control.room_lag import NO_LAG, RoomLag
from cohaptic.control.stability.anticipation import anticipated
from cohaptic.control.stability.lag_choice import (
    FULL_BUDGET,
    choose_lag,
    coupling_radius,
    lag_needed,
)
from cohaptic.control.stability.room_roots import growth
from cohaptic.protocol.patch import check_room
from cohaptic_server.numeric import Floats, Mask
from cohaptic_server.world.lags.planning import FALL_RATE, Planned, find_lag
from cohaptic_server.world.lags.room_loop import hand_stiffness, room_loop
from cohaptic_server.world.state import NO_CAUSE, NOTHING, UserState
from tests.server.touches import changed, touch, user_of
from tests.server.world.lags.lag_rooms import DT, Room, everybody, room_coupling, rooms


def lag_of(
    users: list[UserState], C: Floats, where: list[slice], pressing: Mask, previous: RoomLag
) -> RoomLag:
    """The lag where nothing is anticipated."""
    loop = room_loop(users, C, where, pressing, DT)
    planned = Planned(NOTHING, None, coupling_radius(loop.S))
    return find_lag(loop, planned, previous, NO_CAUSE, DT)[0]


@given(rooms())
def test_the_lag_is_chosen_for_the_slowest_loop_and_the_weakest_device_of_those_who_count(
    room: Room,
) -> None:
    users, C, where, pressing = room
    found = lag_of(users, C, where, pressing, NO_LAG)
    count = [user for user, counts in zip(users, pressing.tolist(), strict=True) if counts]
    # Nothing is known of a loop before its first sample; the ramp to a new patch is one period.
    longest = max([max(0.0, u.delay.recent) + DT for u in count], default=DT)
    budget = min([u.touch.who.damping_budget for u in count], default=math.inf)
    m = room_coupling(users, C, where, pressing)
    assert found == pytest.approx(choose_lag(m, longest, budget))


@given(rooms(2), st.floats(0.01, 0.5))
def test_hands_held_still_are_stable_with_it(room: Room, delay: float) -> None:
    """The theorem of science 3.8, by the roots of the room with everybody's own delay."""
    users, C, where, pressing = room
    pressing[:] = True
    users = [
        replace(user, delay=LoopDelay().measured(delay * fraction, 0.0))
        for user, fraction in zip(users, np.linspace(0.2, 1.0, len(users)).tolist(), strict=True)
    ]
    found = lag_of(users, C, where, pressing, NO_LAG)
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
    users, C, where, pressing = room
    i = data.draw(st.integers(0, len(users) - 1))
    stale = [*users]
    stale[i] = replace(users[i], touch=replace(users[i].touch, fresh=False))
    off = pressing.copy()
    off[i] = False
    assert lag_of(stale, C, where, pressing, NO_LAG) == lag_of(users, C, where, off, NO_LAG)


@given(rooms(), st.floats(0.0, 10.0))
def test_it_rises_at_once_and_falls_slowly(room: Room, before: float) -> None:
    """What was still to come does not come all at once."""
    users, C, where, pressing = room
    chosen = lag_of(users, C, where, pressing, NO_LAG)
    found = lag_of(users, C, where, pressing, RoomLag(before, 1.0, 1.0))
    assert found.lag >= chosen.lag
    assert found.coupling == chosen.coupling
    if found.lag > chosen.lag:
        assert before - found.lag == pytest.approx(max(FALL_RATE, before) * DT)
    # And it is said how far the room is from the edge with the lag that it has.
    assert found.margin >= chosen.margin


@given(rooms(2), st.booleans())
def test_its_cause_is_the_weakest_device_or_the_slowest_loop_of_those_who_count(
    room: Room, anticipate: bool
) -> None:
    """With full damping of these devices, or without delay of these loops, it is shorter."""
    users, C, where, pressing = room
    loop = room_loop(users, C, where, pressing, DT)
    whole = anticipated(loop.S) if anticipate else None
    gains = None if whole is None else whole.gains
    planned = Planned(NOTHING, gains, coupling_radius(loop.S))
    found, cause = find_lag(loop, planned, NO_LAG, NO_CAUSE, DT)
    by_number = {user.touch.user: user for user in users}
    count = [user for user, presses in zip(users, pressing.tolist(), strict=True) if presses]
    if not cause.users:
        assert found.lag == 0.0 or loop.damping_budget >= FULL_BUDGET
        return
    assert found.lag > 0.0
    assert set(cause.users) <= {user.touch.user for user in count}
    if cause.by == "damping":
        damping = [by_number[number].touch.who.damping_budget for number in cause.users]
        assert damping == [min(user.touch.who.damping_budget for user in count)] * len(damping)
        other = replace(loop, damping_budget=FULL_BUDGET)
    else:
        assert not anticipate
        delays = [by_number[number].delay.counted for number in cause.users]
        assert delays == [max(user.delay.counted for user in count)] * len(delays)
        other = replace(loop, longest_delay=0.0)
    assert find_lag(other, planned, NO_LAG, NO_CAUSE, DT)[0].lag < found.lag


def test_the_worst_room_can_be_said_and_says_that_it_is_not_stable() -> None:
    """64 hands at one place on the slowest loops, one of them with gains of its own choice."""
    n = 64
    C = 0.02 * (np.ones((n, n)) + 1e-6 * np.eye(n))
    users = [user_of(touch(i + 1, max_stiffness=1e6, damping_budget=0.0)) for i in range(n)]
    users = [replace(u, delay=LoopDelay().measured(TOO_LONG, 0.0)) for u in users]
    where = [slice(i, i + 1) for i in range(n)]
    slow = lag_of(users, C, where, everybody(n), NO_LAG)
    check_room(slow, remote=False)
    assert slow.coupling == pytest.approx(n - 1, rel=1e-3)
    assert slow.margin == pytest.approx(slow.lag / lag_needed(slow.coupling, TOO_LONG + DT))
    assert slow.margin < 1.0
    fixed = [replace(u, touch=changed(u.touch, fixed_gains=Gains(1e6, 0.0))) for u in users]
    stiff = lag_of(fixed, C, where, everybody(n), NO_LAG)
    check_room(stiff, remote=False)
    assert stiff.margin < 1.0
