from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from cohaptic.simulated.delay_line import LinkSettings
from cohaptic.status.report import TouchStatus
from cohaptic_server.bodies.balloon.balloon import Balloon
from cohaptic_tools.demo.analysis import Recording
from cohaptic_tools.demo.punctuality import Blame
from cohaptic_tools.demo.rest import Rest
from cohaptic_tools.demo.result import DemoResult, evaluate
from cohaptic_tools.demo.scene import Scene, reference
from tests.demo.recordings import dragged, played, save

SCENE = Scene(link=LinkSettings(0.05), duration=9.0)  # of which 8.2 are enough
DRAG = Scene(link=LinkSettings(0.05), duration=9.0, friction=0.8)
DELAY = 0.12  # s after which the recorded hands feel each other
# Relative difference of forces at rest, which the reference and a simulation find differently.
SAME = 2e-3
STATUSES = [
    TouchStatus(name=name, state="free", k_o=250.0, round_trip=0.1, loop_hz=999.0, lag=0.16,
                loop_late_p99=2e-4, loop_missed=3, max_stiffness=2000.0, law="predictive")
    for name in SCENE.names
]  # fmt: skip


@pytest.fixture(scope="module")
def recordings(small_balloon: Balloon) -> list[Recording]:
    """A press and a release in which everybody feels the truth, `DELAY` late."""
    return played(SCENE, small_balloon, seconds=8.4, delay=DELAY)


@pytest.fixture(scope="module")
def good(
    small_balloon: Balloon, recordings: list[Recording], tmp_path_factory: pytest.TempPathFactory
) -> DemoResult:
    return judged(small_balloon, recordings, tmp_path_factory.mktemp("good"))


def judged(
    body: Balloon,
    recordings: Sequence[Recording],
    folder: Path,
    faults: dict[str, set[str]] | None = None,
    *,
    scene: Scene = SCENE,
    statuses: Sequence[TouchStatus] = STATUSES,
) -> DemoResult:
    paths = [save(recording, folder) for recording in recordings]
    return evaluate(scene, body, paths, statuses, faults or {})


def copy(recording: Recording) -> Recording:
    return Recording(recording.name, {c: v.copy() for c, v in recording.columns.items()})


def test_who_felt_the_truth_is_found_to_have_felt_it(
    small_balloon: Balloon, good: DemoResult
) -> None:
    expected = reference(SCENE, small_balloon, pressed=True)
    assert good.presses == 1
    assert good.lag_ms == pytest.approx(160.0)
    assert good.friction == 0.0
    assert [user.name for user in good.users] == ["left", "right"]
    for i, user in enumerate(good.users):
        assert user.truth_from_others_n == pytest.approx(expected.felt_from_others[i])
        assert user.felt_from_others_n == pytest.approx(user.truth_from_others_n, rel=SAME)
        assert user.force_error == pytest.approx(0.0, abs=SAME)
        assert user.force_n == pytest.approx(user.truth_force_n, rel=SAME)
        assert user.rest is Rest.RESTS
        assert user.stable is True
        assert user.faults == ()
        assert user.friction_needed is None
        assert (user.k_h, user.k_o, user.loop_hz, user.loop_missed) == (200.0, 250.0, 999.0, 3)
        assert (user.soft, user.max_stiffness) == (False, 2000.0)
        assert user.loop_late_p99_us == pytest.approx(200.0)
        assert user.round_trip_ms == pytest.approx(100.0)


def test_the_delay_is_that_of_the_force_of_who_waits_for_it(good: DemoResult) -> None:
    """The hand that presses makes the change, and is not late for itself."""
    left, right = good.users
    assert left.felt_onset_ms is left.felt_delay_ms is left.felt_most_ms is None
    for late in (right.felt_onset_ms, right.felt_delay_ms, right.felt_most_ms):
        assert late == pytest.approx(1e3 * DELAY, abs=2.0)


def test_half_the_force_is_half_off_and_no_later(
    small_balloon: Balloon, recordings: list[Recording], good: DemoResult, tmp_path: Path
) -> None:
    left, right = recordings[0], copy(recordings[1])
    right.columns["felt_from_others"] *= 0.5
    result = judged(small_balloon, [left, right], tmp_path)
    assert result.users[1].force_error == pytest.approx(0.5, abs=SAME)
    assert result.users[1].felt_delay_ms == pytest.approx(good.users[1].felt_delay_ms, abs=0.1)


def test_a_force_that_nobody_feels_is_not_far_off(
    recordings: list[Recording], tmp_path: Path, small_balloon: Balloon
) -> None:
    """Of a thousandth of a newton half is nothing."""
    weak = replace(SCENE, depth=1e-5)
    result = judged(small_balloon, [copy(r) for r in recordings], tmp_path, scene=weak)
    for user in result.users:
        felt, true = user.felt_from_others_n, user.truth_from_others_n
        assert felt is not None
        assert true is not None
        assert abs(true) < 0.05
        assert user.force_error == pytest.approx(abs(felt - true) / 0.05)


def test_swinging_creeping_and_soft_are_three_answers(
    small_balloon: Balloon, recordings: list[Recording], tmp_path: Path
) -> None:
    left, right = copy(recordings[0]), copy(recordings[1])
    right.columns["fx"] += 0.1 * np.sin(2.0 * np.pi * 4.0 * right.columns["t"])
    pressing = np.cumsum(left.columns["level"]) / 1000.0
    left.columns["fx"] += 0.2 * pressing * left.columns["level"]
    stiff = [s.model_copy(update={"k_o": 5000.0}) for s in STATUSES]
    result = judged(small_balloon, [left, right], tmp_path, statuses=stiff)
    assert [user.rest for user in result.users] == [Rest.SLOW, Rest.UNSTABLE]
    assert [user.stable for user in result.users] == [True, False]
    assert [user.soft for user in result.users] == [True, True]


def test_too_short_a_demonstration_judges_nobody(
    small_balloon: Balloon, recordings: list[Recording], tmp_path: Path
) -> None:
    """A second and a half: everybody has just come."""
    short = [Recording(r.name, {c: v[:1500] for c, v in r.columns.items()}) for r in recordings]
    result = judged(small_balloon, short, tmp_path)
    assert result.presses == 0
    for user in result.users:
        assert user.felt_from_others_n is user.force_error is user.force_n is None
        assert user.felt_delay_ms is user.stable is None
        assert user.rest is None
        assert user.truth_from_others_n is not None
        assert user.truth_from_others_n > 0.0


def test_hands_that_were_thrown_are_unstable_not_too_short(
    small_balloon: Balloon, recordings: list[Recording], tmp_path: Path
) -> None:
    """The safety layer took the force away, so there is no press to be measured."""
    left, right = recordings[0], copy(recordings[1])
    right.columns["scale"][:] = 0.0
    faults = {"right": {"the hand moved at 3 m/s, more than 2"}}
    result = judged(small_balloon, [left, right], tmp_path, faults)
    assert result.presses == 0
    assert [user.stable for user in result.users] == [None, False]
    assert result.users[1].faults == ("the hand moved at 3 m/s, more than 2",)


def test_a_drag_that_is_felt_as_it_is_has_no_error(balloon: Balloon, tmp_path: Path) -> None:
    result = judged(balloon, dragged(DRAG, balloon, seconds=9.0, delay=DELAY), tmp_path, scene=DRAG)
    left, right = result.users
    assert (result.presses, result.friction) == (1, 0.8)
    for user in result.users:
        assert user.felt_from_others_n == pytest.approx(user.truth_from_others_n, rel=1e-3)
        assert user.force_error == pytest.approx(0.0, abs=1e-3)
        assert user.force_n == pytest.approx(user.truth_force_n, rel=1e-3)
        assert user.rest is Rest.RESTS
        assert user.friction_needed is not None
        assert 0.3 < user.friction_needed < DRAG.friction
    assert right.truth_from_others_n is not None
    assert right.truth_from_others_n > 0.5
    assert left.felt_delay_ms is None
    assert right.felt_delay_ms == pytest.approx(1e3 * DELAY, abs=2.0)


def test_the_result_for_programs_says_what_it_promises(good: DemoResult) -> None:
    reported = json.loads(good.model_dump_json())
    assert reported.keys() >= {"law", "simulation_hz", "delay_ms", "lag_ms", "users"}
    assert (reported["law"], reported["simulation_hz"], reported["delay_ms"]) == (
        "predictive",
        60.0,
        50.0,
    )
    for user in reported["users"]:
        assert user.keys() >= {
            "name",
            "felt_from_others_n",
            "truth_from_others_n",
            "force_error",
            "loop_hz",
            "loop_late_p99_us",
            "felt_onset_ms",
            "felt_delay_ms",
            "felt_most_ms",
            "patch_late_ms",
            "loop_stall_ms",
            "stable",
        }
        assert user["rest"] == "rests"
    assert DemoResult.model_validate_json(good.model_dump_json()) == good


def held_back(recording: Recording, every: float, wait: float) -> Recording:
    """The recording with a patch in each interval `every` that comes `wait` later [s]."""
    t, tick = recording.columns["t"], recording.columns["tick"]
    waits = np.maximum.accumulate(np.where(np.mod(t - t[0], every) < wait, 0.0, tick))
    return Recording(recording.name, recording.columns | {"tick": waits})


@pytest.mark.parametrize("busy", [False, True])
def test_a_force_that_swings_while_patches_come_late_is_not_the_law_s(
    small_balloon: Balloon, recordings: list[Recording], tmp_path: Path, *, busy: bool
) -> None:
    left, right = copy(recordings[0]), recordings[1]
    left.columns["fx"] += 0.5 * np.sin(2.0 * np.pi * 3.0 * left.columns["t"])
    if busy:  # the patch of another user is late, whose hand moves the first one
        right = held_back(right, 1.0, 0.045)
    result = judged(small_balloon, [left, right], tmp_path)
    assert result.users[0].rest is (None if busy else Rest.UNSTABLE)
    assert result.users[1].rest is Rest.RESTS
    assert result.late is (Blame.MACHINE if busy else None)
    assert result.shows_it is busy
    assert not result.proves_it
    if busy:
        assert result.users[1].patch_late_ms == pytest.approx(45.0, abs=17.0)


def test_a_loop_that_stands_still_is_in_the_result(
    small_balloon: Balloon, recordings: list[Recording], tmp_path: Path
) -> None:
    kept = np.ones(recordings[0].columns["t"].size, bool)
    kept[4000:4080] = False
    halted = Recording("left", {name: v[kept] for name, v in recordings[0].columns.items()})
    result = judged(small_balloon, [halted, recordings[1]], tmp_path)
    assert [user.loop_stall_ms for user in result.users] == pytest.approx([81.0, 1.0], abs=0.1)
    assert result.late is Blame.MACHINE
    # It does no harm to a force that rests all the same.
    assert [user.rest for user in result.users] == [Rest.RESTS, Rest.RESTS]
    assert result.proves_it
