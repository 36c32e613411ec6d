from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cohaptic.simulated.hand import Rhythm
from cohaptic_server.numeric import Floats
from cohaptic_tools.demo.analysis import (
    STEP,
    Recording,
    Timeline,
    mean_over,
    measured,
    patch_rate,
    press_windows,
    stretches,
)
from cohaptic_tools.demo.scene import MEASURE
from tests.demo.recordings import blank, save
from tests.examples_of_laws import examples

RHYTHM = Rhythm(4.0)
STRETCH = 0.5 * RHYTHM.period - RHYTHM.ramp  # s pressed, and s off, within each period


def grid(seconds: float, start: float = 0.0) -> Floats:
    return np.asarray(start + STEP * np.arange(round(seconds / STEP)), dtype=np.float64)


def presses(seconds: float, users: int = 2) -> Timeline:
    """The first hand presses in `RHYTHM`, from its release on; the others rest."""
    recordings = [blank(f"user{i}", grid(seconds)) for i in range(users)]
    recordings[0].columns["level"] = np.array([RHYTHM.level(t) for t in grid(seconds)])
    return Timeline.of(recordings)


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


nothing = blank("left", np.zeros(0))


@pytest.mark.parametrize(
    "recordings",
    [
        [nothing, nothing],
        [nothing, blank("right", grid(5.0))],
        [blank("left", grid(1.0)), blank("right", grid(1.0, start=50.0))],
    ],
    ids=["nothing", "one without", "one after the other"],
)
def test_without_a_common_time_nothing_is_known(recordings: list[Recording]) -> None:
    """As when a demonstration is stopped before everybody has come."""
    timeline = Timeline.of(recordings)
    assert timeline.t.size == 0
    assert timeline.force.shape == (2, 0)
    windows = stretches(timeline, pressed=True, expected=STRETCH)
    assert windows == press_windows(timeline, injected=0.1) == []
    assert np.isnan(mean_over(timeline.force, windows)).all()
    assert mean_over(timeline.forces, windows).shape == (2, 3)


@pytest.mark.parametrize("pressed", [True, False])
def test_the_last_part_of_each_press_and_each_release_is_measured(pressed: bool) -> None:
    timeline = presses(12.0)
    level = timeline.columns["level"][0]
    found = stretches(timeline, pressed=pressed, expected=STRETCH)
    assert len(found) == 3
    for stretch in found:
        assert (level[stretch] == (1.0 if pressed else 0.0)).all()
        assert (stretch.stop - stretch.start) * STEP == pytest.approx(STRETCH, abs=0.01)
        # It ends as the hand begins to move on, or as the recording ends.
        assert stretch.stop == len(level) or level[stretch.stop] != level[stretch.start]
        window = measured(stretch)
        assert (window.stop - window.start) * STEP == pytest.approx(MEASURE)
        assert window.stop == stretch.stop


@pytest.mark.parametrize("column", ["scale", "level"])
def test_nothing_is_measured_while_somebody_is_not_in_place(column: str) -> None:
    timeline = presses(12.0)
    timeline.columns[column][1, 7000:] = 0.5
    assert len(stretches(timeline, pressed=True, expected=STRETCH)) == 1
    assert all(w.stop < 7000 for w in press_windows(timeline, injected=0.1))


@pytest.mark.parametrize("rate", [30.0, 60.0])
def test_patches_are_counted_by_their_ticks(rate: float) -> None:
    recording = blank("left", grid(2.0))
    recording.columns["tick"] = 1.0 + np.floor(rate * recording.columns["t"])
    recording.columns["tick"][:500] = 0.0  # none has come yet
    assert patch_rate(Timeline.of([recording]), 0) == pytest.approx(rate, rel=0.03)
