from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from cohaptic.report import TouchStatus
from cohaptic_server.bodies.balloon import Balloon
from cohaptic_server.demo.analysis import Recording, Timeline
from cohaptic_server.demo.replay import felt_at_once
from cohaptic_server.demo.scene import Scene, truth
from cohaptic_server.demo.summary import GOOD_ERROR, DemoResult, evaluate, show, verdict
from tests.server.demo.recordings import blank, played, save

SCENE = Scene(delay=0.05, duration=7.0)
DELAY = 0.12  # s after which the recorded hands feel each other
STATUSES = [
    TouchStatus(name=name, state="free", k_o=250.0, round_trip=0.1, loop_hz=999.0,
                loop_late_p99=2e-4, loop_missed=3)
    for name in SCENE.names
]  # fmt: skip


@pytest.fixture(scope="module")
def recordings(small_balloon: Balloon) -> list[Recording]:
    """One press of a scene in which everybody feels the truth, `DELAY` late."""
    made = played(SCENE, small_balloon, seconds=6.4, delay=0.0)
    timeline = Timeline.of(made)
    at_once = felt_at_once(timeline, small_balloon, slice(0, len(timeline.t)))
    for recording, felt in zip(made, at_once, strict=True):
        t = recording.columns["t"]
        recording.columns["u_others"] = np.interp(t - DELAY, timeline.t, felt)
    return made


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
) -> DemoResult:
    paths = [save(recording, folder) for recording in recordings]
    return evaluate(SCENE, body, paths, STATUSES, faults or {})


def shown(result: DemoResult) -> str:
    console = Console(width=160)
    with console.capture() as capture:
        console.print(show(result))
    return capture.get()


def copy(recording: Recording) -> Recording:
    return Recording(recording.name, {c: v.copy() for c, v in recording.columns.items()})


def test_who_felt_the_truth_is_found_to_have_felt_it(
    small_balloon: Balloon, good: DemoResult
) -> None:
    expected = truth(SCENE, small_balloon, pressed=True)
    assert good.presses == 1
    assert [user.name for user in good.users] == ["left", "right"]
    for i, user in enumerate(good.users):
        assert user.truth_from_others_n == pytest.approx(expected.felt_from_others[i])
        assert user.felt_from_others_n == pytest.approx(user.truth_from_others_n, rel=1e-6)
        assert user.force_error == pytest.approx(0.0, abs=1e-6)
        assert user.force_n == pytest.approx(user.truth_force_n, rel=1e-6)
        assert user.stable is True
        assert user.faults == ()
        assert user.felt_delay_ms == pytest.approx(1e3 * DELAY, abs=1.0)
        assert (user.k_h, user.k_o, user.loop_hz, user.loop_missed) == (200.0, 250.0, 999.0, 3)
        assert user.loop_late_p99_us == pytest.approx(200.0)
        assert user.round_trip_ms == pytest.approx(100.0)


def test_a_good_result_is_told_with_its_force_and_its_delay(good: DemoResult) -> None:
    right = good.users[1]
    assert verdict(good) == (
        f"right felt left press with {right.felt_from_others_n:.2f} N,"
        f" {right.felt_delay_ms:.0f} ms later.\n"
        "Every force came to rest, at most 0.0% from the truth"
        " (predictive law, 50 ms each way, 60 Hz)."
    )
    text = shown(good)
    assert verdict(good).splitlines()[0] in text
    assert "999 Hz" in text
    assert "NO" not in text


def test_half_the_force_is_half_off(
    small_balloon: Balloon, recordings: list[Recording], tmp_path: Path
) -> None:
    left, right = recordings[0], copy(recordings[1])
    right.columns["felt_from_others"] *= 0.5
    result = judged(small_balloon, [left, right], tmp_path)
    assert result.users[1].force_error == pytest.approx(0.5, abs=1e-6)
    assert 0.5 > GOOD_ERROR
    assert "at most 50.0% from the truth" in verdict(result)


def test_a_force_that_nobody_feels_is_not_far_off(
    recordings: list[Recording], tmp_path: Path, small_balloon: Balloon
) -> None:
    """Of a thousandth of a newton half is nothing."""
    weak = replace(SCENE, depth=1e-5)
    paths = [save(copy(recording), tmp_path) for recording in recordings]
    result = evaluate(weak, small_balloon, paths, STATUSES, {})
    for user, told in zip(result.users, recordings, strict=True):
        assert abs(user.truth_from_others_n) < 0.05
        felt = user.felt_from_others_n
        assert felt is not None
        assert told.name == user.name
        assert user.force_error == pytest.approx(abs(felt - user.truth_from_others_n) / 0.05)


def test_a_force_that_swings_is_told_as_unstable(
    small_balloon: Balloon, recordings: list[Recording], tmp_path: Path
) -> None:
    left, right = recordings[0], copy(recordings[1])
    right.columns["fx"] += np.sin(2.0 * np.pi * 4.0 * right.columns["t"])
    result = judged(small_balloon, [left, right], tmp_path)
    assert [user.stable for user in result.users] == [True, False]
    assert verdict(result).startswith("Unstable: the force of right did not come to rest (")
    assert "NO" in shown(result)


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
        assert user.truth_from_others_n > 0.0
    assert verdict(result).startswith("Too short to tell: no whole press was seen (")
    assert shown(result).count("?") == 2 * 4


def test_a_demonstration_without_a_single_period_is_too_short_too(
    small_balloon: Balloon, tmp_path: Path
) -> None:
    empty = [blank(name, np.zeros(0)) for name in SCENE.names]
    result = judged(small_balloon, empty, tmp_path)
    assert verdict(result).startswith("Too short to tell")


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
    assert verdict(result).startswith("Unstable: the force of right did not come to rest (")
    assert "force was off for a while: right: the hand moved" in shown(result)


def test_the_result_for_programs_says_what_it_promises(good: DemoResult) -> None:
    told = json.loads(good.model_dump_json())
    assert told.keys() >= {"law", "simulation_hz", "delay_ms", "users"}
    assert (told["law"], told["simulation_hz"], told["delay_ms"]) == ("predictive", 60.0, 50.0)
    for user in told["users"]:
        assert user.keys() >= {
            "name",
            "felt_from_others_n",
            "truth_from_others_n",
            "force_error",
            "loop_hz",
            "loop_late_p99_us",
            "felt_delay_ms",
            "stable",
        }
    assert DemoResult.model_validate_json(good.model_dump_json()) == good


def test_a_machine_that_cannot_keep_up_is_told_so(
    small_balloon: Balloon, recordings: list[Recording], tmp_path: Path
) -> None:
    slow = [
        Recording(r.name, r.columns | {"tick": np.floor(0.5 * r.columns["tick"])})
        for r in recordings
    ]
    result = judged(small_balloon, slow, tmp_path)
    assert result.users[0].patch_hz == pytest.approx(30.0, rel=0.05)
    assert verdict(result).startswith(
        "This machine cannot keep up with 2 users: patches came at 30"
    )
