from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cohaptic_server.numeric import Floats
from cohaptic_tools.demo.analysis import (
    STEP,
    Recording,
    Timeline,
)
from tests.demo.recordings import blank, save
from tests.examples_of_laws import examples


def grid(seconds: float, start: float = 0.0) -> Floats:
    return np.asarray(start + STEP * np.arange(round(seconds / STEP)), dtype=np.float64)


def test_a_recording_is_read_as_a_client_wrote_it(tmp_path: Path) -> None:
    """The stamps become Unix time, so that recordings of several processes fit."""
    written = blank("left", grid(0.05, start=7.0))
    written.columns["fx"] += 2.5
    read = Recording.load(save(written, tmp_path, to_wall=1.7e9))
    assert read.name == "left"
    assert set(read.columns) == set(written.columns)
    assert read.columns["t"] == pytest.approx(written.columns["t"] + 1.7e9, abs=1e-6)
    assert (read.columns["fx"] == 2.5).all()


@given(st.floats(0.0, 0.5), st.floats(0.0, 0.5), st.floats(0.0007, 0.0025))
@settings(max_examples=examples(30), deadline=None)
def test_recordings_lie_side_by_side_where_all_of_them_exist(
    later: float, earlier: float, period: float
) -> None:
    """Whatever their rates: what is linear in time stays so, for each user."""
    first = blank("left", np.arange(0.0, 1.5, period))
    second = blank("right", np.arange(later, 1.5 - earlier, 0.001))
    for recording, slope in ((first, 2.0), (second, -3.0)):
        recording.columns["x"] = slope * recording.columns["t"]
    timeline = Timeline.of([first, second])
    assert timeline.t[0] == pytest.approx(later)
    assert timeline.t[-1] <= min(first.columns["t"][-1], second.columns["t"][-1])
    assert np.diff(timeline.t) == pytest.approx(STEP)
    assert timeline.columns["x"] == pytest.approx(
        np.array([2.0 * timeline.t, -3.0 * timeline.t]), abs=1e-12
    )
