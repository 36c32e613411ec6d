from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic_server.access.admission import UsedTokens
from cohaptic_server.access.keys import Denied


@given(st.lists(st.tuples(st.integers(0, 5), st.floats(0.0, 10.0)), max_size=40))
def test_a_token_is_used_once_within_its_life_and_the_memory_is_bounded(
    uses: list[tuple[int, float]],
) -> None:
    used, now, last = UsedTokens(limit=3), 0.0, dict[int, float]()
    for name, step in uses:
        now += step
        try:
            used.use(str(name), now + 5.0, now)
        except Denied as error:
            if "used before" in str(error):
                assert last[name] > now
            else:
                assert sum(end > now for end in last.values()) == 3
        else:
            assert last.get(name, 0.0) <= now
            last[name] = now + 5.0
        assert len(used) <= 3


def test_when_it_is_full_nobody_new_comes_in_and_no_token_counts_twice() -> None:
    used = UsedTokens(limit=2)
    used.use("a", 10.0, 0.0)
    used.use("b", 20.0, 0.0)
    with pytest.raises(Denied, match="the limit: try again later"):
        used.use("c", 10.0, 5.0)
    with pytest.raises(Denied, match="used before"):
        used.use("a", 10.0, 5.0)
    used.use("c", 30.0, 10.0)
