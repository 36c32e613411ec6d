from __future__ import annotations

from typing import Any

import pytest
from rich.console import Console

from cohaptic_tools.demo.punctuality import Blame
from cohaptic_tools.demo.rest import Rest
from cohaptic_tools.demo.result import DemoResult, UserResult
from cohaptic_tools.demo.summary import show, verdict

HOW = "(predictive law, 50 ms each way, 60 Hz)"


def user(name: str, **other: Any) -> UserResult:
    """One for whom all is well."""
    values: dict[str, Any] = {
        "name": name, "felt_from_others_n": 2.97, "truth_from_others_n": 2.97,
        "force_error": 0.0, "force_n": 4.0, "truth_force_n": 4.0, "k_o": 250.0, "k_h": 250.0,
        "max_stiffness": 2000.0, "soft": False, "friction_needed": None, "loop_hz": 999.0,
        "loop_late_p99_us": 200.0, "loop_missed": 0, "round_trip_ms": 100.0,
        "felt_onset_ms": None if name == "left" else 170.0,
        "felt_delay_ms": None if name == "left" else 193.4,
        "felt_most_ms": None if name == "left" else 377.0, "patch_hz": 60.0, "patch_late_ms": 2.0,
        "loop_stall_ms": 1.5, "stable": True,
        "rest": Rest.RESTS, "faults": (),
    }  # fmt: skip
    return UserResult(**(values | other))


def result(left: dict[str, Any] | None = None, **right: Any) -> DemoResult:
    return DemoResult(
        law="predictive",
        simulation_hz=60.0,
        delay_ms=50.0,
        jitter_ms=0.0,
        network="delay=50",
        seed=0,
        friction=0.0,
        lag_ms=0.0,
        presses=2,
        late=None,
        enough_s=8.2,
        users=(user("left", **(left or {})), user("right", **right)),
    )


def shown(reported: DemoResult, width: int = 160) -> str:
    console = Console(width=width)
    with console.capture() as capture:
        console.print(show(reported))
    return capture.get()


def test_a_good_result_is_told_with_its_force_and_its_delay() -> None:
    assert verdict(result()) == (
        "right felt left press with 2.97 N, half of it 193 ms later.\n"
        f"Every force came to rest, at most 0.0% from the truth {HOW}."
    )
    text = shown(result())
    assert verdict(result()).splitlines()[0] in text
    assert "999 Hz" in text
    assert "193 ms" in text
    assert text.count("yes") == 2
    for bad in ("NO", "slow", "?", "device", "answers"):
        assert bad not in text


@pytest.mark.parametrize("faint", [{"felt_from_others_n": -0.19}, {"felt_from_others_n": 0.01}])
def test_what_nobody_feels_is_no_success(faint: dict[str, Any]) -> None:
    for reported in (result(faint), result(**faint)):
        assert verdict(reported).startswith("Too weak to feel: ")
        assert "a hand clearly feels 0.2 N.\nEvery force came to rest" in verdict(reported)
        assert reported.least_felt == pytest.approx(abs(faint["felt_from_others_n"]))
    other = result().model_copy(update={"users": (*result().users, user("user3", **faint))})
    assert verdict(other).startswith("right felt left press")


def test_a_demonstration_in_which_nobody_feels_anything_or_a_force_swings_has_failed() -> None:
    assert result().shows_it
    assert result(felt_from_others_n=0.06).shows_it
    assert not result(felt_from_others_n=-0.04).shows_it
    assert not result({"stable": False, "rest": Rest.UNSTABLE}).shows_it
    unknown = {"stable": None, "rest": None, "felt_from_others_n": 0.0}
    assert result(unknown, **unknown).shows_it


def test_unstable_slow_and_soft_are_three_sentences() -> None:
    soft = {"soft": True, "k_o": 5000.0, "force_error": 0.23}
    swinging = result(soft | {"rest": Rest.SLOW}, rest=Rest.UNSTABLE, stable=False)
    creeping = result(soft, rest=Rest.SLOW, force_error=0.1)
    assert verdict(swinging) == (
        f"Unstable: the force of right swings and does not come to rest {HOW}."
    )
    assert verdict(creeping).splitlines()[1] == (
        f"Slow: the force of right still creeps to its value, at most 23.0% from the truth {HOW}."
    )
    assert verdict(result(soft)).splitlines()[1] == (
        "Soft: every force came to rest, and the device of left is the softer,"
        f" at most 23.0% from the truth {HOW}."
    )
    assert "NO" in shown(swinging)
    assert "slow" in shown(creeping)


def test_a_drag_is_told_as_one() -> None:
    reported = result(friction_needed=0.54).model_copy(update={"friction": 0.8})
    assert verdict(reported).startswith(
        "right felt left drag with 2.97 N, half of it 193 ms later."
    )
    assert "drag felt" in shown(reported)
    assert "slips" not in shown(reported)


def test_what_kept_a_force_from_being_judged_is_named() -> None:
    unknown = result({"patch_late_ms": 40.0}, rest=None, stable=None, loop_stall_ms=35.0)
    busy = unknown.model_copy(update={"late": Blame.MACHINE})
    assert verdict(busy).startswith(
        "This machine was too busy to judge the force of right: a patch for left came 40 ms late"
    )
    wavering = unknown.model_copy(update={"late": Blame.LINK, "network": "delay=50,jitter=40"})
    assert verdict(wavering).startswith("The link kept the force of right moving: a patch for left")
    assert "by a network that wavers (predictive law, each way delay=50,jitter=40" in verdict(
        wavering
    )
    for reported in (busy, wavering):
        assert reported.shows_it
        assert not reported.proves_it


@pytest.mark.parametrize("width", [80, 100, 120, 160])
def test_it_fits_into_every_terminal(width: int) -> None:
    text = shown(result(), width)
    assert max(map(len, text.splitlines())) <= width
    assert "…" not in text
