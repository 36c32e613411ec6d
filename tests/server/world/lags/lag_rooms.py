"""Rooms for the tests of lags: users, the compliance between them, and which of them press."""

from __future__ import annotations

import itertools

import numpy as np
from hypothesis import strategies as st

from cohaptic.control.law import Law
from cohaptic.control.stability.lag_choice import FULL_BUDGET, coupling_radius
from cohaptic_server.numeric import Floats, Mask
from cohaptic_server.world.lags.room_loop import room_loop
from cohaptic_server.world.state import UserState
from tests.server.touches import touch, user_of

DT = 1.0 / 60.0  # s
delays = st.floats(0.0, 1.0)
budgets = st.floats(0.0, 2.0 * FULL_BUDGET)
Room = tuple[list[UserState], Floats, list[slice], Mask]


@st.composite
def rooms(draw: st.DrawFn, least: int = 1, law: Law | None = Law.PREDICTIVE) -> Room:
    """Users, C of all their loads, which are whose, and which users press."""
    n: int = draw(st.integers(least, 6))
    frictional = draw(st.lists(st.booleans(), min_size=n, max_size=n))
    ends: list[int] = np.cumsum([0] + [3 if r else 1 for r in frictional]).tolist()
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
                friction=frictional[i],
                max_stiffness=draw(st.floats(100.0, 5000.0)),
                damping_budget=draw(budgets),
            ),
            delay=draw(st.none() | delays),
        )
        for i in range(n)
    ]
    pressing = np.array(draw(st.lists(st.booleans(), min_size=n, max_size=n)))
    where = [slice(a, b) for a, b in itertools.pairwise(ends)]
    return users, C * np.outer(scale, scale), where, pressing


def everybody(n: int) -> Mask:
    """All n users press."""
    return np.ones(n, dtype=np.bool_)


def room_coupling(users: list[UserState], C: Floats, where: list[slice], pressing: Mask) -> float:
    """m of a room."""
    return coupling_radius(room_loop(users, C, where, pressing, DT).S)
