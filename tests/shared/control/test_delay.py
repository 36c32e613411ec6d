from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic.control.delay import STEADY_TIME, TOO_LONG, WINDOW, LoopDelay
from cohaptic.control.playout import FALL, RISE

delays = st.floats(0.0, 2.0)
DT = 1.0 / 60.0


@given(st.lists(st.tuples(delays, st.floats(0.001, 1.0)), min_size=1, max_size=60))
def test_it_is_that_of_one_to_two_windows(seen: list[tuple[float, float]]) -> None:
    state, now, times = LoopDelay(), 10.0, list[tuple[float, float]]()
    for delay, wait in seen:
        now += wait
        state = state.measured(delay, now)
        times.append((now, delay))
        recent = [d for t, d in times if now - t < WINDOW]
        late = [d for t, d in times if now - t <= 2.0 * WINDOW + 1.0]
        assert max(recent) <= state.value <= max(late)


@given(st.lists(st.floats(0.01, 0.1), min_size=1, max_size=300), st.booleans())
def test_a_delay_that_glides_as_playing_makes_it_is_steady(waits: list[float], rises: bool) -> None:
    delay, now = 1.0, 0.0
    state = LoopDelay().measured(delay, now)
    for dt in waits:
        now += dt
        delay = min(2.0, delay + RISE * dt) if rises else max(0.0, delay - 2.0 * FALL * dt)
        state = state.measured(delay, now, dt)
        assert state.unsteady <= 1e-9


def max_unsteady(pause: float, every: float, changes: int) -> float:
    """Largest mean square in a loop that is later by a pause, or on time again, so often [s2]."""
    state, limit = LoopDelay().measured(0.1, 0.0), 0.0
    for k in range(round(every * (changes + 1) / DT)):
        late = round(k * DT // every) % 2 == 1
        state = state.measured(0.1 + (pause if late else 0.0), k * DT, DT)
        limit = max(limit, state.unsteady)
    return limit


@given(st.floats(0.05, 0.25), st.floats(1.0, 2.0))
def test_a_pause_counts_by_its_cube_and_pauses_again_and_again_by_their_sum(
    pause: float, every: float
) -> None:
    """The glide follows a pause within four times as long, so that its mean distance is small."""
    once = max_unsteady(pause, every, changes=1)
    assert once == pytest.approx(pause**3 / (3.0 * RISE) / STEADY_TIME, rel=0.35)
    assert max_unsteady(pause, every, changes=8) > 1.5 * once


@given(delays, st.lists(st.floats(-0.02, 0.0), min_size=1, max_size=100))
def test_gains_do_not_chatter_with_jitter(delay: float, jitter: list[float]) -> None:
    """Below the largest of late nothing moves the value within a window."""
    state = LoopDelay().measured(delay, 0.0)
    for k, less in enumerate(jitter):
        state = state.measured(max(0.0, delay + less), WINDOW * k / 200.0)
        assert state.value == delay


@given(st.lists(st.floats(0.0, 20.0), max_size=10), st.floats(0.01, 10.0))
def test_a_room_counts_measured_delays_and_waits_for_nobody_beyond_a_limit(
    seen: list[float], wait: float
) -> None:
    """A newcomer slows nobody down before anything is known; one who is too slow only watches."""
    state = LoopDelay()
    assert (state.counted, state.too_long) == (0.0, False)
    for k, delay in enumerate(seen):
        state = state.measured(delay, k * wait)
        assert state.counted == min(TOO_LONG, state.value)
        assert state.too_long == (state.value > TOO_LONG)
