from __future__ import annotations

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic.errors import SettingError
from cohaptic_server.objects.cost import MAX_HZ, MAX_USERS, MIN_HZ, Demand

USERS, HZ = st.integers(1, MAX_USERS), st.floats(MIN_HZ, MAX_HZ)
NODES = st.integers(1, 20_000)


@given(USERS, HZ, st.booleans(), NODES, st.integers(0, 63), st.floats(0.0, 190.0), NODES)
def test_what_more_users_or_a_higher_rate_afford_fewer_and_a_lower_one_do(
    users: int, hz: float, nonlinear: bool, nodes: int, more: int, faster: float, fewer: int
) -> None:
    hard = Demand(min(MAX_USERS, users + more), min(MAX_HZ, hz + faster), nonlinear)
    easy = Demand(users, hz, nonlinear)
    assert easy.affords(min(nodes, fewer)) or not hard.affords(nodes)


@given(USERS, HZ, st.booleans())
def test_what_is_refused_says_how_many_are_not(users: int, hz: float, nonlinear: bool) -> None:
    demand = Demand(users, hz, nonlinear)
    try:
        demand.check()
    except SettingError as error:
        words = str(error)
        assert f"--users is {users}" in words
        assert f"{hz:g} Hz" in words
        assert words.count("\n") == 0
        if "at most" in words:
            limit = int(words.partition("at most ")[2].split()[0])
            assert limit < users
            replace(demand, users=limit).check()
            with pytest.raises(SettingError):
                replace(demand, users=limit + 1).check()


@pytest.mark.parametrize(("users", "hz"), [(0, 60.0), (65, 60.0), (2, 9.0), (2, float("nan"))])
def test_a_demand_out_of_range_is_refused(users: int, hz: float) -> None:
    with pytest.raises(SettingError, match="--users" if hz == 60.0 else "--hz"):
        Demand(users, hz)
