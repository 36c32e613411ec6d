from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cohaptic_server.bodies.balloon.balloon import Balloon
from cohaptic_server.numeric import Floats
from cohaptic_tools.demo.analysis import AROUND, STEP, Timeline
from cohaptic_tools.demo.comparison import felt_at_once, instants
from cohaptic_tools.demo.scene import Scene, reference
from tests.demo.recordings import played

SCENE = Scene(delay=0.02)
WINDOW = slice(2800, 4300)  # of the grid, round the first press
NEAR = 0.02  # of a force, between equilibria that were found in different ways
SLIDE = 0.06  # of a force, that a contact finds on its way when tips rest and others push suddenly


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
    t, felt = felt_at_once(lone, small_balloon, WINDOW)
    assert felt.shape == (2, len(t))
    assert felt[0] == pytest.approx(0.0, abs=1e-9)
    assert np.ptp(felt[1]) > 1.0


def test_what_is_felt_of_a_press_is_what_the_truth_says(
    timeline: Timeline, small_balloon: Balloon
) -> None:
    """Recorded were the forces of the equilibrium: at rest the body gives them again, at once."""
    _, felt = felt_at_once(timeline, small_balloon, WINDOW)
    for at, pressed in ((0, False), (-1, True)):
        true = reference(SCENE, small_balloon, pressed=pressed).felt_from_others
        assert felt[:, at] == pytest.approx(true, rel=NEAR, abs=1e-3)


def test_others_are_felt_at_once(timeline: Timeline, small_balloon: Balloon) -> None:
    """A force that is suddenly there is felt at the next instant, whole: no lag, no limit."""
    begins = 4100
    still = slice(begins - round(AROUND / STEP), begins + 300)
    since = np.arange(len(timeline.t)) >= begins
    sudden = {c: timeline.columns[c][0] * since for c in ("fx", "fy", "fz")}
    t, felt = felt_at_once(changed(timeline, 0, **sudden), small_balloon, still)
    before = t < timeline.t[begins]
    assert felt[1, before] == pytest.approx(0.0, abs=1e-9)
    assert felt[1, ~before] == pytest.approx(felt[1, -1], rel=SLIDE)
    assert felt[1, -1] > 1.0


def test_the_past_before_a_window_plays_no_part(timeline: Timeline, small_balloon: Balloon) -> None:
    """Contacts have followed from the window's first instant on."""
    _, felt = felt_at_once(timeline, small_balloon, slice(4000, 4100))
    assert np.ptp(felt, axis=1) == pytest.approx(0.0, abs=1e-3)
    _, later = felt_at_once(timeline, small_balloon, slice(4500, 4600))
    assert felt[:, -1] == pytest.approx(later[:, -1], abs=1e-3)


def test_a_stronger_neighbour_is_felt_in_proportion(
    timeline: Timeline, small_balloon: Balloon
) -> None:
    """The body is linear, and the contact of a hand at rest follows its surface only a little."""
    still = slice(4000, 4100)
    felt: list[float] = []
    for share in (0.0, 0.5, 1.0):
        pushed = {c: share * timeline.columns[c][0] for c in ("fx", "fy", "fz")}
        _, forces = felt_at_once(changed(timeline, 0, **pushed), small_balloon, still)
        felt.append(float(forces[1, -1]))
    assert felt[0] == pytest.approx(0.0, abs=1e-9)
    assert felt[1] == pytest.approx(0.5 * felt[2], rel=SLIDE)
    assert felt[2] > 1.0


def test_the_damping_of_the_hand_is_not_the_bodys(
    timeline: Timeline, small_balloon: Balloon
) -> None:
    """What the passivity layer adds to a force reaches no neighbour."""
    still, damping = slice(4000, 4100), 0.7
    size = np.linalg.norm(timeline.forces[0], axis=0)
    way = timeline.forces[0] / np.maximum(size, 1e-9)
    columns = dict(zip(("fx", "fy", "fz"), timeline.forces[0] + damping * way, strict=True))
    damped = changed(timeline, 0, **columns, damping=damping)
    _, felt = felt_at_once(timeline, small_balloon, still)
    _, same = felt_at_once(damped, small_balloon, still)
    assert same[1] == pytest.approx(felt[1], rel=NEAR)


def test_instants_are_close_where_forces_change_and_few_where_they_rest() -> None:
    window = slice(1000, 5000)
    at = instants(window)
    begins = window.start + round(AROUND / STEP)
    assert (np.diff(at) > 0).all()
    assert at[0] == window.start
    assert begins in at
    assert at[-1] < window.stop
    fine = np.diff(at[(at >= begins) & (at <= begins + 900)])
    assert fine.max() * STEP < 0.02
    assert len(at) < 0.1 * (window.stop - window.start)
