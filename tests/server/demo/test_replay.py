from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cohaptic_server.bodies.balloon import Balloon
from cohaptic_server.bodies.mesh import Floats
from cohaptic_server.demo.analysis import STEP, Timeline
from cohaptic_server.demo.replay import TICK, felt_at_once
from cohaptic_server.demo.scene import Scene
from tests.server.demo.recordings import played

SCENE = Scene(delay=0.02)
WINDOW = slice(2800, 4300)  # of the grid, round the first press
SLIDE = 0.1  # of a movement, by which contacts that slide on the facets change it


@pytest.fixture(scope="module")
def timeline(small_balloon: Balloon) -> Timeline:
    """Two hands in the truth of a press, seven seconds."""
    return Timeline.of(played(SCENE, small_balloon, seconds=7.0, delay=0.0))


def changed(timeline: Timeline, user: int, **columns: Floats | float) -> Timeline:
    """The same timeline, with other columns for one user."""
    copy = {name: values.copy() for name, values in timeline.columns.items()}
    for name, values in columns.items():
        copy[name][user] = values
    return replace(timeline, columns=copy)


def test_who_is_alone_feels_nobody(timeline: Timeline, small_balloon: Balloon) -> None:
    """Nobody else presses, so no contact moves, whatever the own force does."""
    lone = changed(timeline, 1, fx=0.0, fy=0.0, fz=0.0)
    felt = felt_at_once(lone, small_balloon, WINDOW)
    assert felt.shape == (2, WINDOW.stop - WINDOW.start)
    assert felt[0] == pytest.approx(0.0, abs=1e-12)
    assert np.ptp(felt[1]) > 1e-3


def test_what_is_felt_of_a_press_is_what_the_truth_says(
    timeline: Timeline, small_balloon: Balloon
) -> None:
    felt = felt_at_once(timeline, small_balloon, WINDOW)
    true = timeline.columns["u_others"][:, WINDOW]
    assert felt == pytest.approx(true, abs=SLIDE * np.ptp(true))


def test_others_are_felt_at_once(timeline: Timeline, small_balloon: Balloon) -> None:
    """A force that is suddenly there has moved the other contact within one tick."""
    still, begins = slice(4000, 4200), 4100
    since = np.arange(len(timeline.t)) >= begins
    sudden = {c: timeline.columns[c][0] * since for c in ("fx", "fy", "fz")}
    felt = felt_at_once(changed(timeline, 0, **sudden), small_balloon, still)[1]
    tick = round(TICK / STEP)
    assert felt[: begins - still.start - tick] == pytest.approx(0.0, abs=1e-12)
    assert (felt[begins - still.start + tick :] > (1.0 - SLIDE) * felt[-1]).all()
    assert felt[-1] > 1e-3


def test_the_past_before_a_window_plays_no_part(timeline: Timeline, small_balloon: Balloon) -> None:
    """Forces are all there from the window's first tick on: none is still rising."""
    still = slice(4000, 4100)
    felt = felt_at_once(timeline, small_balloon, still)
    assert np.ptp(felt, axis=1) == pytest.approx(0.0, abs=1e-6)
    later = felt_at_once(timeline, small_balloon, slice(4500, 4600))
    assert felt[:, -1] == pytest.approx(later[:, -1], abs=1e-6)


def test_a_stronger_neighbour_moves_the_contact_in_proportion(
    timeline: Timeline, small_balloon: Balloon
) -> None:
    """The body is linear, and the contact of a hand at rest follows its surface only a little."""
    still = slice(4000, 4000 + round(4 * TICK / STEP))
    lifts: list[float] = []
    for share in (0.0, 0.5, 1.0):
        pushed = {c: share * timeline.columns[c][0] for c in ("fx", "fy", "fz")}
        lifts.append(
            float(felt_at_once(changed(timeline, 0, **pushed), small_balloon, still)[1, -1])
        )
    assert lifts[0] == pytest.approx(0.0, abs=1e-12)
    assert lifts[1] == pytest.approx(0.5 * lifts[2], rel=SLIDE)
    assert lifts[2] > 1e-3
