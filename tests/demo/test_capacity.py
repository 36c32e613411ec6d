from __future__ import annotations

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from cohaptic.errors import SettingError
from cohaptic_tools.demo.capacity import RATES, Machine, rate_for
from cohaptic_tools.demo.scene import MAX_USERS, MIN_USERS

BEST, LOWEST = RATES
USERS = st.integers(MIN_USERS, MAX_USERS)
UNITS = st.floats(5e-4, 3e-2)
MACHINES = st.builds(
    Machine, UNITS, st.floats(0.5, 32.0), st.floats(0.1, 1.0), st.sampled_from(["", "no compiler"])
)


@given(MACHINES, USERS)
def test_the_rate_is_the_best_that_the_machine_keeps_up_with(machine: Machine, users: int) -> None:
    try:
        rate, words = rate_for(machine, users, None)
    except SettingError:
        assert machine.load(users, LOWEST) * machine.free > 1.0
        return
    assert rate == (BEST if users <= machine.bears(BEST) else LOWEST)
    assert (words == "") == (rate == BEST and not machine.why_plain)
    assert ("may come late" in words) == (users > machine.bears(LOWEST))


@given(MACHINES)
def test_more_hands_than_a_machine_bears_are_refused_with_the_number_that_it_bears(
    machine: Machine,
) -> None:
    assume(machine.load(MAX_USERS, LOWEST) * machine.free > 1.0)
    with pytest.raises(SettingError, match="users is 16; it must be at most") as refused:
        rate_for(machine, MAX_USERS, None)
    limit = int(str(refused.value).partition("at most ")[2].partition(" ")[0])
    rate_for(machine, limit, None)
    with pytest.raises(SettingError, match=f"at most {limit} at 30 Hz on this machine"):
        rate_for(machine, limit + 1, None)
