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
from cohaptic_tools.demo.analysis import Recording, Timeline, stretches
from cohaptic_tools.demo.punctuality import Blame
from cohaptic_tools.demo.rest import Rest
from cohaptic_tools.demo.result import DemoResult, evaluate
from cohaptic_tools.demo.scene import Scene, reference
from tests.demo.recordings import blank, dragged, played, save

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


def test_a_surface_that_is_there_before_the_force_does_not_count(
    small_balloon: Balloon, recordings: list[Recording], good: DemoResult, tmp_path: Path
) -> None:
    """As with the integral law: 200 ms that only the force is later."""
    left, right = recordings[0], copy(recordings[1])
    felt = right.columns["felt_from_others"]
    right.columns["felt_from_others"] = np.concatenate([np.full(200, felt[0]), felt[:-200]])
    right.columns["u_others"] = felt.copy()
    result = judged(small_balloon, [left, right], tmp_path)
    before = good.users[1].felt_delay_ms
    assert before is not None
    assert result.users[1].felt_delay_ms == pytest.approx(before + 200.0, abs=1.0)


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


@pytest.mark.parametrize(
    ("k_o", "law", "soft"),
    [(2000.0, "predictive", False), (2015.0, "predictive", False), (2050.0, "predictive", True),
     (2050.0, "pi", False)],
)  # fmt: skip
def test_a_device_is_soft_by_more_than_a_hundredth_and_where_it_should_be_as_stiff(
    small_balloon: Balloon,
    recordings: list[Recording],
    tmp_path: Path,
    k_o: float,
    law: str,
    soft: bool,
) -> None:
    """The paper's laws are softer by themselves."""
    statuses = [s.model_copy(update={"k_o": k_o, "law": law}) for s in STATUSES]
    result = judged(small_balloon, recordings, tmp_path, statuses=statuses)
    assert [user.soft for user in result.users] == [soft, soft]


def test_of_hands_in_a_hurry_none_is_called_unstable(
    small_balloon: Balloon, recordings: list[Recording], tmp_path: Path
) -> None:
    """What swings at the end of half a second has not had the time to stop."""
    left, right = copy(recordings[0]), copy(recordings[1])
    right.columns["fx"] += 0.1 * np.sin(2.0 * np.pi * 4.0 * right.columns["t"])
    hurried = replace(SCENE, duration=8.0)
    result = judged(small_balloon, [left, right], tmp_path, scene=hurried)
    assert [user.rest for user in result.users] == [Rest.RESTS, None]
    assert result.enough_s == pytest.approx(8.2)
    right.columns["fx"][-100] = 10.0
    result = judged(small_balloon, [left, right], tmp_path, scene=hurried)
    assert [user.rest for user in result.users] == [Rest.RESTS, Rest.UNSTABLE]


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


@pytest.mark.parametrize("scene", [SCENE, DRAG], ids=["presses", "drags"])
def test_a_demonstration_without_a_single_period_is_too_short_too(
    small_balloon: Balloon, tmp_path: Path, scene: Scene
) -> None:
    empty = [blank(name, np.zeros(0)) for name in scene.names]
    result = judged(small_balloon, empty, tmp_path, scene=scene)
    assert result.presses == 0
    assert [user.rest for user in result.users] == [None, None]


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


def test_where_a_finger_slips_there_is_no_truth_to_it(balloon: Balloon, tmp_path: Path) -> None:
    slippery = replace(DRAG, friction=0.3)
    made = dragged(slippery, balloon, seconds=9.0, delay=DELAY)
    result = judged(balloon, made, tmp_path, scene=slippery)
    for user in result.users:
        assert user.truth_from_others_n is user.force_error is user.truth_force_n is None
        assert user.felt_from_others_n is not None
        assert user.friction_needed is not None
        assert user.friction_needed > slippery.friction


def test_the_result_for_programs_says_what_it_promises(good: DemoResult) -> None:
    told = json.loads(good.model_dump_json())
    assert told.keys() >= {"law", "simulation_hz", "delay_ms", "lag_ms", "users"}
    assert (told["law"], told["simulation_hz"], told["delay_ms"]) == ("predictive", 60.0, 50.0)
    for user in told["users"]:
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


def late_at(recording: Recording, *times: float, wait: float) -> Recording:
    """The recording with no new patch for `wait` from each of some times after its start on [s]."""
    t, tick = recording.columns["t"], recording.columns["tick"].copy()
    for time in times:
        tick[(t - t[0] >= time) & (t - t[0] < time + wait)] = 0.0
    return Recording(recording.name, recording.columns | {"tick": np.maximum.accumulate(tick)})


def test_a_late_patch_after_all_swings_excuses_none_of_them(
    small_balloon: Balloon, recordings: list[Recording], tmp_path: Path
) -> None:
    """One for the other hand, just before the end of each stretch."""
    left, right = copy(recordings[0]), recordings[1]
    left.columns["fx"] += 0.5 * np.sin(2.0 * np.pi * 3.0 * left.columns["t"])
    timeline = Timeline.of([left, right])
    expected = 0.5 * SCENE.rhythm.period - SCENE.rhythm.ramp
    held = [s for p in (True, False) for s in stretches(timeline, pressed=p, expected=expected)]
    right = late_at(right, *(float(timeline.t[s.stop - 60]) for s in held), wait=0.036)
    result = judged(small_balloon, [left, right], tmp_path)
    assert [user.rest for user in result.users] == [Rest.UNSTABLE, Rest.RESTS]
    assert result.late is Blame.MACHINE


@pytest.mark.parametrize("busy", [False, True])
def test_what_a_force_does_while_a_hand_moves_accuses_it_if_nothing_was_late_then(
    small_balloon: Balloon, recordings: list[Recording], tmp_path: Path, *, busy: bool
) -> None:
    """Between two stretches it reaches the limit of its device, or throws the hand."""
    left, right = copy(recordings[0]), recordings[1]
    moving = float(left.columns["t"][np.flatnonzero(np.diff(left.columns["level"]))[100]])
    if busy:
        right = late_at(right, moving - 0.1, wait=0.2)
    expected = Rest.RESTS if busy else Rest.UNSTABLE
    at = (left.columns["t"] >= moving) & (left.columns["t"] < moving + 0.03)
    thrown = judged(
        small_balloon, [left, right], tmp_path, faults={"left": {"the hand moved at 5 m/s"}}
    )
    assert thrown.users[0].rest is (None if busy else Rest.UNSTABLE)
    left.columns["fx"][at] = 10.1
    limited = judged(small_balloon, [left, right], tmp_path)
    assert limited.users[0].rest is expected


def test_a_press_in_which_something_came_late_is_not_measured_beside_one_on_time(
    small_balloon: Balloon, tmp_path: Path
) -> None:
    """Of two presses the second has a late patch, and half of the force."""
    scene = replace(SCENE, duration=14.0)
    left, right = played(scene, small_balloon, seconds=13.6, delay=DELAY)
    t = right.columns["t"] - right.columns["t"][0]
    right.columns["felt_from_others"] *= np.where(t > 7.0, 0.5, 1.0)
    both = judged(small_balloon, [left, right], tmp_path, scene=scene)
    assert both.presses == 2
    assert both.users[1].force_error == pytest.approx(0.25, abs=0.02)
    tick = right.columns["tick"]
    tick[(t > 10.0) & (t < 10.1)] = tick[t > 10.0][0]
    late = judged(small_balloon, [left, right], tmp_path, scene=scene)
    assert late.presses == 1
    assert late.users[1].force_error == pytest.approx(0.0, abs=SAME)


def test_a_link_that_wavers_is_blamed_before_the_law_and_the_machine(
    small_balloon: Balloon, recordings: list[Recording], tmp_path: Path
) -> None:
    left = held_back(copy(recordings[0]), 1.0, 0.045)
    left.columns["fx"] += 0.5 * np.sin(2.0 * np.pi * 3.0 * left.columns["t"])
    wavering = replace(SCENE, link=LinkSettings(0.05, 0.04), duration=10.0)
    result = judged(small_balloon, [left, recordings[1]], tmp_path, scene=wavering)
    assert (result.users[0].rest, result.late) == (None, Blame.LINK)
    assert result.shows_it


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


def test_a_hand_thrown_while_nothing_came_on_time_accuses_nobody(
    small_balloon: Balloon, recordings: list[Recording], tmp_path: Path
) -> None:
    left, right = recordings[0], held_back(recordings[1], 1.0, 0.3)
    right.columns["scale"] *= 0.0
    faults = {"right": {"the hand moved at 3 m/s, more than 2"}}
    result = judged(small_balloon, [left, right], tmp_path, faults)
    assert [user.stable for user in result.users] == [None, None]
    assert result.late is Blame.MACHINE


def test_patches_that_come_at_half_the_rate_are_counted_so(
    small_balloon: Balloon, recordings: list[Recording], tmp_path: Path
) -> None:
    slow = [
        Recording(r.name, r.columns | {"tick": np.floor(0.5 * r.columns["tick"])})
        for r in recordings
    ]
    result = judged(small_balloon, slow, tmp_path)
    assert result.users[0].patch_hz == pytest.approx(30.0, rel=0.05)
