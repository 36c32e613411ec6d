from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from cohaptic.status.quantiles import Tally


@given(st.lists(st.floats(1e-6, 10.0), min_size=1, max_size=300), st.floats(0.01, 1.0))
def test_a_quantile_is_right_to_the_width_of_a_bucket(values: list[float], q: float) -> None:
    tally = Tally()
    for value in values:
        tally.add(value)
    exact = float(np.quantile(values, q, method="inverted_cdf"))
    assert exact * 0.999 <= tally.quantile(q) <= exact * 1.1
