from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cohaptic.hands import Rhythm
from cohaptic_server.bodies.mesh import Floats
from cohaptic_server.demo.analysis import (
    STEP,
    Recording,
    Timeline,
    felt_delay,
    is_still,
    mean_over,
    plateaus,
    press_windows,
    ripple,
)
from cohaptic_server.demo.scene import MEASURE
from tests.server.demo.recordings import blank, save

RHYTHM = Rhythm(4.0)
STRETCH = 0.5 * RHYTHM.period - RHYTHM.ramp  # s pressed, and s off, within each period
LIMIT = 10.0  # N


def grid(seconds: float, start: float = 0.0) -> Floats:
    return np.asarray(start + STEP * np.arange(round(seconds / STEP)), dtype=np.float64)


def presses(seconds: float, users: int = 2) -> Timeline:
    """The first hand presses in `RHYTHM`, from its release on; the others rest."""
    recordings = [blank(f"user{i}", grid(seconds)) for i in range(users)]
    recordings[0].columns["level"] = np.array([RHYTHM.level(t) for t in grid(seconds)])
    return Timeline.of(recordings)


def smooth(seconds: float, seed: int) -> Floats:
    """A force that changes as hands change it: a few waves of up to 3 Hz, never quite at rest."""
    rng, t = np.random.default_rng(seed), grid(seconds)
    waves = zip(
        rng.uniform(0.3, 1.0, 4), rng.uniform(0.3, 3.0, 4), rng.uniform(0, 6, 4), strict=True
    )
    return np.asarray(sum(a * np.sin(2.0 * np.pi * f * t + p) for a, f, p in waves))


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
@settings(max_examples=30, deadline=None)
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
    windows = plateaus(timeline, pressed=True, expected=STRETCH)
    assert windows == press_windows(timeline, injected=0.1) == []
    assert is_still(timeline.force, windows, LIMIT) == [None, None]
    assert np.isnan(mean_over(timeline.force, windows)).all()
    assert np.isnan(ripple(timeline.force, windows)).all()


def test_a_force_is_a_length() -> None:
    recording = blank("left", grid(0.1))
    for column, value in (("fx", 2.0), ("fy", -3.0), ("fz", 6.0)):
        recording.columns[column] += value
    assert Timeline.of([recording]).force == pytest.approx(7.0)


@pytest.mark.parametrize("pressed", [True, False])
def test_the_last_part_of_each_press_and_each_release_is_measured(pressed: bool) -> None:
    timeline = presses(12.0)
    level = timeline.columns["level"][0]
    windows = plateaus(timeline, pressed=pressed, expected=STRETCH)
    assert len(windows) == 3
    for window in windows:
        assert (level[window] == (1.0 if pressed else 0.0)).all()
        assert (window.stop - window.start) * STEP == pytest.approx(min(MEASURE, 0.4 * STRETCH))
        # It ends as the hand begins to move on, or as the recording ends.
        assert window.stop == len(level) or level[window.stop] != level[window.start]


def test_a_press_that_was_cut_short_is_not_measured() -> None:
    # Pressed from 2.3 s on; 0.8 of a stretch is long enough, less is not.
    enough, short = 2.3 + 0.8 * STRETCH + 0.05, 2.3 + 0.8 * STRETCH - 0.05
    assert len(plateaus(presses(enough), pressed=True, expected=STRETCH)) == 1
    assert plateaus(presses(short), pressed=True, expected=STRETCH) == []


@pytest.mark.parametrize("column", ["scale", "level"])
def test_nothing_is_measured_while_somebody_is_not_in_place(column: str) -> None:
    timeline = presses(12.0)
    timeline.columns[column][1, 7000:] = 0.5
    assert len(plateaus(timeline, pressed=True, expected=STRETCH)) == 1
    assert all(w.stop < 7000 for w in press_windows(timeline, injected=0.1))


def test_means_are_over_all_windows_together() -> None:
    values = np.array([[1.0, 1.0, 9.0, 4.0], [2.0, 2.0, 9.0, 8.0]])
    assert mean_over(values, [slice(0, 2), slice(3, 4)]) == pytest.approx([2.0, 4.0])


@given(st.floats(0.0, 5.0), st.floats(-2.0, 2.0), st.floats(0.0, 1.0))
def test_ripple_is_what_is_left_about_a_straight_line(
    size: float, drift: float, amplitude: float
) -> None:
    t = grid(0.6)
    wave = amplitude * np.sin(2.0 * np.pi * 10.0 * t)  # six whole periods: hardly any slope
    found = ripple(np.array([size + drift * t, size + drift * t + wave]), [slice(0, len(t))])
    assert found[0] == pytest.approx(0.0, abs=1e-12)
    # A sine has a slope of its own: about 3/pi of an amplitude over each period, of six.
    assert found[1] == pytest.approx(2.0 * amplitude, rel=0.2, abs=1e-12)


def test_the_worst_window_counts() -> None:
    values = np.zeros((1, 1000))
    values[0, 600:700:2] = 3.0
    assert ripple(values, [slice(0, 400), slice(500, 1000), slice(0, 500)])[0] > 2.0


def constant(t: Floats) -> Floats:
    return np.full_like(t, 3.0)


def settling(t: Floats) -> Floats:
    return 3.0 - 0.2 * np.exp(-t)


def trembling(t: Floats) -> Floats:
    return 3.0 + 0.1 * np.sin(2.0 * np.pi * 5.0 * t)


def swinging(t: Floats) -> Floats:
    return 3.0 + 0.5 * np.sin(2.0 * np.pi * 5.0 * t)


def bumping(t: Floats) -> Floats:
    """At rest when measured, but the device gave all it can on the way."""
    return np.where((t > 2.0) & (t < 2.1), LIMIT, 3.0)


@pytest.mark.parametrize(
    ("force", "still"),
    [(constant, True), (settling, True), (trembling, True), (swinging, False), (bumping, False)],
)
def test_a_force_is_still_when_it_rests_and_keeps_off_the_limit(force: object, still: bool) -> None:
    assert callable(force)
    timeline = presses(8.0)
    windows = plateaus(timeline, pressed=True, expected=STRETCH)
    both = np.array([constant(timeline.t), force(timeline.t)])
    assert is_still(both, windows, LIMIT) == [True, still]


def test_around_each_press_and_release_there_is_a_window_for_the_news_to_come_back() -> None:
    timeline = presses(12.0)
    windows = press_windows(timeline, injected=0.4)
    # Changes begin at 2, 4, 6, 8 and 10 s; the one at 0 s has no time before it.
    assert [w.start * STEP for w in windows] == pytest.approx([1.5, 3.5, 5.5, 7.5, 9.5], abs=0.003)
    assert all((w.stop - w.start) * STEP == pytest.approx(0.5 + 1.0 + 0.4) for w in windows)
    # The last one is left out where the recording ends too early for it.
    assert len(press_windows(presses(11.3), injected=0.4)) == 4


@given(st.integers(0, 249), st.integers(0, 2**32 - 1), st.floats(0.0, 0.02))
@settings(max_examples=50, deadline=None)
def test_a_known_delay_is_found_to_a_millisecond(lag: int, seed: int, noise: float) -> None:
    """Also through noise of a hundredth of the signal."""
    at_once = smooth(3.0, seed)
    felt = np.concatenate([np.full(lag, at_once[0]), at_once])[: len(at_once)]
    felt = felt + noise * np.random.default_rng(seed).normal(size=len(felt))
    found = felt_delay(felt, at_once, longest=0.3)
    assert found == pytest.approx(lag * STEP, abs=1.001 * STEP)


@pytest.mark.parametrize("lag", [0, 80, 250])
def test_the_delay_of_one_press_is_found_in_its_window(lag: int) -> None:
    timeline = presses(8.0)
    (window, *_) = press_windows(timeline, injected=0.3)
    level = timeline.columns["level"][0]
    felt = np.concatenate([np.zeros(lag), level])[: len(level)]
    found = felt_delay(2.0 * felt[window], 2.0 * level[window], longest=0.5)
    assert found == pytest.approx(lag * STEP)
