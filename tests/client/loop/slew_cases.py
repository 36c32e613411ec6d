"""Constants and strategies of the tests of slew limits."""

from __future__ import annotations

from hypothesis import strategies as st

from cohaptic.control.friction import Compliance3

PERIOD = 0.001  # s
TICK = 1.0 / 60.0  # s
ROUNDING = 1e-9  # relative; doubles
STEP = 0.0203  # N; `EXTERNAL_RATE` in a period, and the second order of a turn
gains = st.floats(0.1, 1e5)
depths = st.floats(-0.05, 0.05)
seeds = st.integers(0, 2**32 - 1)
BALL = Compliance3(1e-3, 1e-3, 1e-3, 0.0, 0.0, 0.0)
SKEWED = Compliance3(1e-3, 1e-3, 1e-3, 0.0, 5e-4, 0.0)
