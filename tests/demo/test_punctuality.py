from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic_server.numeric import Floats
from cohaptic_tools.demo.analysis import Recording
from cohaptic_tools.demo.punctuality import Lateness, lateness, part_on_time
from tests.demo.recordings import blank

HZ = 60.0
PERIOD = 1.0 / HZ
START, END = 1.0, 3.0  # s
STEP = 0.001  # s; how exactly the time of a patch is known


def received(at: Floats) -> Recording:
    """A hand that gets the patch of tick n at the time `at[n]` [s], and keeps the newest."""
    recording = blank("left", np.arange(0.0, 4.0, STEP))
    newest = np.maximum.accumulate(at[::-1] * -1.0)[::-1] * -1.0  # when n or a later one is there
    shown = np.searchsorted(newest, recording.columns["t"], side="right") - 1
    recording.columns["tick"] = shown.astype(np.float64)
    return recording


def found(recording: Recording) -> Lateness:
    return lateness(recording, START, END, PERIOD)


@given(st.floats(0.0, 0.5), st.integers(70, 170), st.floats(0.0, 0.3))
def test_what_comes_late_is_found_whatever_the_usual_delay(
    delay: float, tick: int, late: float
) -> None:
    at = delay + PERIOD * np.arange(240.0)
    at[tick] += late
    at = np.maximum.accumulate(at)  # on a stream the later ones wait behind it
    # The one before it is shown meanwhile; the interval may end before the late one has come.
    shown = min(late, max(0.0, END - delay - PERIOD * tick))
    inside = START < delay + PERIOD * tick < END - PERIOD
    if inside and shown == late:
        assert found(received(at)).patch == pytest.approx(late, abs=2.0 * STEP)
    assert found(received(at)).patch <= late + 2.0 * STEP


@given(st.integers(70, 170), st.floats(1.1 * PERIOD, 0.3))
def test_the_longest_part_without_anything_late_is_found_if_it_is_most_of_a_stretch(
    tick: int, late: float
) -> None:
    at = PERIOD * np.arange(240.0)
    at[tick] += late + PERIOD
    recordings = [received(PERIOD * np.arange(240.0)), received(np.maximum.accumulate(at))]
    t = recordings[0].columns["t"]
    stretch = slice(round(START / STEP), round(END / STEP))
    part = part_on_time(recordings, t, stretch, PERIOD)
    before = PERIOD * (tick + 1) - START
    after = END - PERIOD * (tick + 1) - late
    if part is None:
        assert max(before, after) < 0.8 * (END - START) + 2.0 * PERIOD
    else:
        assert stretch.start <= part.start < part.stop <= stretch.stop
        assert STEP * (part.stop - part.start) == pytest.approx(
            max(before, after), abs=2.5 * PERIOD
        )
        for recording in recordings:
            there = lateness(recording, float(t[part.start]), float(t[part.stop - 1]), PERIOD)
            assert there.blame(PERIOD, 0.0) is None
    assert part_on_time(recordings[:1], t, stretch, PERIOD) == stretch
