from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic_server.objects import cost
from cohaptic_server.objects.cost import (
    Cost,
    TooCostlyError,
    check_memory,
    edge_that_fits,
)

pytestmark = pytest.mark.live


@given(st.floats(0.005, 0.45), st.floats(0.5e9, 1e11), st.floats(0.5e9, 1e11), st.floats(1.0, 4.0))
def test_a_longer_edge_fits_and_no_shorter_one_is_proposed(
    edge: float, needed: float, memory: float, growth: float
) -> None:
    found = edge_that_fits(edge, needed, memory, growth)
    assert found <= 0.5
    if found < 0.5:
        program = cost._PROGRAM  # pyright: ignore[reportPrivateUsage]
        left = (needed - program) * (edge / found) ** growth
        assert left <= max(memory - program, needed - program)
        assert needed <= memory or left <= memory - program


def test_what_takes_too_much_says_every_way_out() -> None:
    costly = Cost(3.2e9, 60.0)
    check_memory(costly, 3.2e9, "it", 0.03, 2)
    with pytest.raises(TooCostlyError) as found:
        check_memory(costly, 2e9, "organ.ply: 40,000 tetrahedra", 0.03, 2)
    for words in ("3.2 GB", "2 GB", "--edge 0.03", "--order 1", "--max-memory 3.4"):
        assert words in str(found.value)
    with pytest.raises(TooCostlyError) as found:
        check_memory(costly, 2e9, "a volume", None, 1)
    assert "--edge" not in str(found.value)
    assert "--order" not in str(found.value)
