from __future__ import annotations

import math

from hypothesis import given
from hypothesis import strategies as st

from cohaptic_server.progress import TimeLeft


@given(st.floats(2.0, 1e4), st.floats(0.01, 1.0), st.floats(0.0, 1e6))
def test_at_a_steady_rate_the_time_left_is_right(whole: float, share: float, begin: float) -> None:
    left = TimeLeft(begin).seconds(share, begin + share * whole)
    if left == math.inf:  # nothing is said in the first two seconds, as far as they are exact
        assert share * whole < 2.0 + 1e-9 * (1.0 + begin)
    else:
        assert share * whole > 1.99
        assert math.isclose(left, (1.0 - share) * whole, abs_tol=1e-3 + 1e-6 * begin)


def test_nothing_is_said_before_something_is_known() -> None:
    left = TimeLeft(100.0)
    assert left.words(0.0, 200.0) == ""
    assert left.words(0.5, 101.0) == ""
    assert left.words(0.25, 130.0) == "1:30 left"
    assert left.words(1.0, 130.0) == "0:00 left"
