from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from cohaptic_server.numeric import Floats
from cohaptic_server.world.applied_forces import (
    EFFECT_RATE,
    MAX_COUPLING_RATIO,
    MAX_SUM,
    allowed_fractions,
    fair_cap,
    limit_forces,
    low_pass,
)

ROUNDING = 1e-9  # relative
demands = hnp.arrays(np.float64, st.integers(1, 16), elements=st.floats(0.0, 100.0))
totals = st.floats(0.01, 500.0)


# One level


@given(demands, totals)
def test_what_is_cut_to_the_level_is_all_that_there_is(wanted: Floats, total: float) -> None:
    cut = np.minimum(wanted, fair_cap(wanted, total))
    assert cut.sum() == pytest.approx(min(total, wanted.sum()), rel=ROUNDING)


@given(demands, totals)
def test_what_is_below_the_level_is_left_whole_and_nobody_above_it_gets_more_than_another(
    wanted: Floats, total: float
) -> None:
    """As water fills vessels; nobody is cut where all can have what they want."""
    at = fair_cap(wanted, total)
    if wanted.sum() <= total:
        assert at == math.inf
        return
    assert total / len(wanted) * (1.0 - ROUNDING) <= at < wanted.max()
    cut = np.minimum(wanted, at)
    assert (cut[wanted <= at] == wanted[wanted <= at]).all()
    assert (cut[wanted > at] == at).all()


# Forces


@given(demands, st.data())
def test_a_body_carries_no_more_than_it_can(wanted: Floats, data: st.DataObject) -> None:
    n = len(wanted)
    deepest = data.draw(hnp.arrays(np.float64, n, elements=st.floats(0.0, 100.0)))
    carried = limit_forces(wanted, deepest)
    assert carried.sum() <= MAX_SUM * (1.0 + ROUNDING)
    assert (carried <= np.minimum(wanted, deepest)).all()
    asked = np.minimum(wanted, deepest)
    if asked.sum() <= MAX_SUM:
        assert (carried == asked).all()
    else:
        assert carried.sum() == pytest.approx(MAX_SUM)


# Changes

max_of_all = st.floats(1e-3, 5.0)


@st.composite
def rooms(draw: st.DrawFn) -> tuple[Floats, Floats, Floats]:
    """Changes, stiffnesses and compliances, some of them not known yet."""
    n = draw(st.integers(1, 12))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    A = rng.normal(size=(n, n + 1))
    C = A @ A.T * rng.uniform(1e-4, 1e-2)
    stiffness = np.minimum(1.0 / np.diag(C), rng.uniform(100.0, 5000.0, n))
    if draw(st.booleans()):
        C[rng.random((n, n)) < 0.2] = np.inf
    change = rng.uniform(0.0, 10.0, n) * (rng.random(n) < 0.7)
    return change, stiffness, C


def effects(change: Floats, stiffness: Floats, C: Floats) -> Floats:
    """How each (row) is moved by each other (column) [N]."""
    effect = np.minimum(stiffness[:, None] * np.abs(C), MAX_COUPLING_RATIO) * change
    return np.asarray(effect * (1.0 - np.eye(len(change))))


@given(rooms(), max_of_all)
def test_nobody_is_moved_faster_than_that_by_all_others_together(
    room: tuple[Floats, Floats, Floats], limit: float
) -> None:
    change, stiffness, C = room
    fractions = allowed_fractions(change, stiffness, C, limit)
    assert ((0.0 <= fractions) & (fractions <= 1.0)).all()
    felt = effects(fractions * change, stiffness, C).sum(axis=1)
    assert (felt <= limit * (1.0 + ROUNDING)).all()


@given(rooms(), max_of_all)
def test_who_moves_nobody_much_is_not_held_back_whatever_others_do(
    room: tuple[Floats, Floats, Floats], limit: float
) -> None:
    """Cut is who is above the level of a hand that is moved too fast: the one who shakes pays."""
    change, stiffness, C = room
    effect = effects(change, stiffness, C)
    at = np.array([fair_cap(row, limit) for row in effect])
    fractions = allowed_fractions(change, stiffness, C, limit)
    for j in range(len(change)):
        untouched = (effect[:, j] <= at).all()
        assert (fractions[j] == 1.0) == untouched
        # No level is below an even share.
        if (effect[:, j] <= limit / max(1, len(change) - 1)).all():
            assert fractions[j] == 1.0


@given(rooms(), max_of_all)
def test_nobody_is_held_back_further_than_is_needed(
    room: tuple[Floats, Floats, Floats], limit: float
) -> None:
    """Whoever is cut has a hand that feels as much as may be."""
    change, stiffness, C = room
    fractions = allowed_fractions(change, stiffness, C, limit)
    effect = effects(change, stiffness, C)
    cut = [np.minimum(row, fair_cap(row, limit)) for row in effect]
    for j in np.flatnonzero(fractions < 1.0):
        tightest = min(cut[i][j] / effect[i, j] for i in np.flatnonzero(effect[:, j] > 0.0))
        assert fractions[j] == pytest.approx(tightest)


def test_a_press_as_hands_press_is_untouched_and_a_blow_is_not() -> None:
    """6 N within 0.1 s beside a hand that shares all of the compliance."""
    C, stiffness, dt = np.full((2, 2), 0.004), np.full(2, 250.0), 1.0 / 60.0
    limit = EFFECT_RATE * dt
    press = np.array([6.0 / 0.1 * dt, 0.0])
    assert allowed_fractions(press, stiffness, C, limit).tolist() == [1.0, 1.0]
    blow = np.array([10.0, 0.0])
    assert allowed_fractions(blow, stiffness, C, limit) == pytest.approx([limit / 10.0, 1.0])


# The lag


@given(
    st.lists(
        st.tuples(st.floats(-10.0, 10.0), st.floats(-10.0, 10.0), st.floats(0.0, 3.0)),
        min_size=1,
        max_size=5,
    ),
    st.floats(0.005, 0.1),
)
def test_forces_come_in_each_behind_its_lag(
    forces: list[tuple[float, float, float]], dt: float
) -> None:
    """tau f~' = f - f~, an implicit step; at once without a lag."""
    before, now, lag = (np.array(column) for column in zip(*forces, strict=True))
    found = low_pass(before, now, lag, dt)
    assert lag * (found - before) / dt == pytest.approx(now - found, abs=1e-6)
    assert (found[lag == 0.0] == now[lag == 0.0]).all()
    assert (found >= np.minimum(before, now) - 1e-12).all()
    assert (found <= np.maximum(before, now) + 1e-12).all()
