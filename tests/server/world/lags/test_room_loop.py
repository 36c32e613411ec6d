from __future__ import annotations

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic.control.delay import TOO_LONG
from cohaptic.control.law import Law
from cohaptic.control.laws.model import Gains
from cohaptic_server.world.lags.room_loop import hand_stiffness, room_loop
from tests.server.touches import changed, touch, user_of
from tests.server.world.lags.lag_rooms import DT, Room, everybody, room_coupling, rooms


@given(st.floats(10.0, 1e4), st.floats(10.0, 1e4), st.floats(-0.99, 0.99), st.booleans())
def test_two_users_are_coupled_by_what_each_makes_of_the_other(
    one: float, two: float, fraction: float, presses: bool
) -> None:
    """m = sqrt(K_1 K_2) |C_12|, and 0 with one who does not press."""
    C = np.array([[0.004, fraction * 0.004], [fraction * 0.004, 0.004]])
    users = [user_of(touch(i, max_stiffness=k)) for i, k in enumerate((one, two), start=1)]
    k = math.sqrt(min(250.0, one) * min(250.0, two))
    where = [slice(0, 1), slice(1, 2)]
    found = room_coupling(users, C, where, np.array([True, presses]))
    assert found == pytest.approx(k * 0.004 * abs(fraction) * presses, abs=1e-12)
    assert room_coupling(users[:1], C[:1, :1], where[:1], everybody(1)) == 0.0


@given(rooms(2))
def test_the_stiffest_hand_that_presses_counts_in_full(room: Room) -> None:
    """With friction in its stiffest direction."""
    users, C, where, pressing = room
    expected = 0.0
    for user, span, presses in zip(users, where, pressing.tolist(), strict=True):
        if presses:
            stiffness = np.linalg.eigvalsh(hand_stiffness(user, C[span, span]))[-1]
            expected = max(expected, float(stiffness))
    found = room_loop(users, C, where, pressing, DT).stiffest
    assert expected * (1.0 - 1e-9) <= found <= 3.0 * expected
    lone = [i for i, span in enumerate(where) if span.stop - span.start == 1 and pressing[i]]
    if lone and not any(user.touch.who.friction for user in users):
        limits = [min(users[i].touch.who.max_stiffness, 1.0 / C[i, i]) for i in lone]
        assert found == pytest.approx(max(limits))


@given(rooms(2, law=None), st.data())
def test_a_hand_that_does_not_press_couples_with_nobody(room: Room, data: st.DataObject) -> None:
    """Whatever law it runs."""
    users, C, where, pressing = room
    away = data.draw(st.integers(0, len(users) - 1))
    pressing[away] = False
    here = [i for i in range(len(users)) if i != away]
    rows = [row for i in here for row in range(where[i].start, where[i].stop)]
    ends = np.cumsum([0] + [where[i].stop - where[i].start for i in here]).tolist()
    without = room_coupling(
        [users[i] for i in here],
        C[np.ix_(rows, rows)],
        [slice(a, b) for a, b in itertools.pairwise(ends)],
        pressing[here],
    )
    if len(here) > 1:
        assert room_coupling(users, C, where, pressing) == pytest.approx(without, abs=1e-12)


@given(rooms(2, law=None), st.data())
def test_the_loop_is_that_of_a_room_of_those_who_press(room: Room, data: st.DataObject) -> None:
    """A user who does not press, is silent or is too slow changes no value of the loop.

    A single hand has no coupling, so at least two of them press.
    """
    users, C, where, pressing = room
    pressing[:2] = True
    for i, presses in enumerate(pressing.tolist()):
        if not presses and data.draw(st.booleans()):
            pressing[i], touch_ = True, users[i].touch
            silent = data.draw(st.booleans())
            users[i] = (
                replace(users[i], touch=replace(touch_, fresh=False))
                if silent
                else user_of(touch_, delay=1.01 * TOO_LONG)
            )
    inside = pressing & np.array([u.touch.fresh and not u.delay.too_long for u in users])
    here = np.flatnonzero(inside).tolist()
    rows = [row for i in here for row in range(where[i].start, where[i].stop)]
    ends = np.cumsum([0] + [where[i].stop - where[i].start for i in here]).tolist()
    spans = [slice(a, b) for a, b in itertools.pairwise(ends)]
    whole = room_loop(users, C, where, pressing, DT)
    part = room_loop(
        [users[i] for i in here], C[np.ix_(rows, rows)], spans, everybody(len(here)), DT
    )
    assert whole.inside.tolist() == inside.tolist()
    assert whole.stiffest == pytest.approx(part.stiffest)
    for name in (
        "longest_delay", "damping_budget", "slowest", "weakest", "predictive", "paper_laws",
    ):  # fmt: skip
        assert getattr(whole, name) == getattr(part, name)
    assert whole.S[np.ix_(rows, rows)] == pytest.approx(part.S, abs=1e-9)
    assert np.abs(np.delete(whole.S, rows, axis=0)).max(initial=0.0) == 0.0


@given(rooms(2, law=Law.PROPORTIONAL))
def test_the_papers_laws_are_coupled_with_their_own_dent_too(room: Room) -> None:
    """With the gains of the row rule, which bear any delay: at most 1 without friction."""
    users, C, where, pressing = room
    pressing[:] = True
    others = [np.abs(C[w.start]).sum() - np.abs(C[w.start, w]).sum() for w in where]
    fractions: list[float] = []
    for user, w, coupled in zip(users, where, others, strict=True):
        own = float(C[w.start, w.start])
        fractions.append(own * min(user.touch.who.max_stiffness, 1.0 / (own + float(coupled))))
    found = room_coupling(users, C, where, pressing)
    assert found >= max(fractions) * (1.0 - 1e-9)
    if len(C) == len(users):
        assert found <= 1.0 + 1e-9


@given(rooms(), st.data())
def test_a_hand_is_as_stiff_as_it_will_be_told(room: Room, data: st.DataObject) -> None:
    users, C, where, _ = room
    i = data.draw(st.integers(0, len(users) - 1))
    own, limit = C[where[i], where[i]], users[i].touch.who.max_stiffness
    K = hand_stiffness(users[i], own)
    # One share of the object's stiffness in all directions, of which the law has the normal's.
    fraction = min(1.0, limit * own[0, 0])
    assert pytest.approx(fraction * np.eye(len(own)), abs=1e-9) == K @ own
    # The paper's laws go by what the others do, too.
    others = data.draw(st.floats(0.0, 0.1))
    paper = replace(users[i], touch=changed(users[i].touch, law=Law.PI))
    fraction = min(limit, 1.0 / (own[0, 0] + others)) * own[0, 0]
    assert (
        pytest.approx(fraction * np.eye(len(own)), abs=1e-9)
        == hand_stiffness(paper, own, others) @ own
    )
    assert (hand_stiffness(users[i], own, others) == K).all()
    fixed = Gains(data.draw(st.floats(1.0, 1e5)), 0.0)
    reported = replace(users[i], touch=changed(users[i].touch, fixed_gains=fixed))
    chosen: float = min(limit, fixed.k_h)
    fraction = chosen * float(own[0, 0])
    assert (
        pytest.approx(fraction * np.eye(len(own)), abs=1e-6) == hand_stiffness(reported, own) @ own
    )
