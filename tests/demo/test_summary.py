from __future__ import annotations

from typing import Any

import pytest
from rich.console import Console

from cohaptic_tools.demo.punctuality import Blame
from cohaptic_tools.demo.rest import Rest
from cohaptic_tools.demo.result import GOOD_ERROR, DemoResult, UserResult
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


def shown(told: DemoResult, width: int = 160) -> str:
    console = Console(width=width)
    with console.capture() as capture:
        console.print(show(told))
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


def test_a_delay_that_nobody_could_measure_is_left_out() -> None:
    assert verdict(result(felt_delay_ms=None)).startswith("right felt left press with 2.97 N.\n")


@pytest.mark.parametrize("faint", [{"felt_from_others_n": -0.19}, {"felt_from_others_n": 0.01}])
def test_what_nobody_feels_is_no_success(faint: dict[str, Any]) -> None:
    for told in (result(faint), result(**faint)):
        assert verdict(told).startswith("Too weak to feel: ")
        assert "a hand clearly feels 0.2 N.\nEvery force came to rest" in verdict(told)
        assert told.least_felt == pytest.approx(abs(faint["felt_from_others_n"]))
    other = result().model_copy(update={"users": (*result().users, user("user3", **faint))})
    assert verdict(other).startswith("right felt left press")


def test_a_demonstration_in_which_nobody_feels_anything_or_a_force_swings_has_failed() -> None:
    assert result().shows_it
    assert result(felt_from_others_n=0.06).shows_it
    assert not result(felt_from_others_n=-0.04).shows_it
    assert not result({"stable": False, "rest": Rest.UNSTABLE}).shows_it
    unknown = {"stable": None, "rest": None, "felt_from_others_n": 0.0}
    assert result(unknown, **unknown).shows_it


def test_a_drag_is_not_judged_as_a_press() -> None:
    told = result(felt_from_others_n=0.1).model_copy(update={"friction": 0.8})
    assert told.least_felt is None
    assert verdict(told).startswith("right felt left drag")


def test_an_error_is_told() -> None:
    assert 0.5 > GOOD_ERROR
    assert "not where they should: up to 50.0% off" in verdict(result(force_error=0.5))


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


def test_a_device_that_is_softer_and_an_object_that_takes_its_time_are_told() -> None:
    told = result(soft=True, k_o=5000.0).model_copy(update={"lag_ms": 160.0})
    for width in (80, 100, 120, 160):
        text = shown(told, width)
        assert "right: device renders 2,000 of 5,000 N/m" in text
        assert "the object answers the others in 0.16 s" in text
    assert "answers" not in shown(result().model_copy(update={"lag_ms": 1.0}))


def test_a_drag_is_told_as_one() -> None:
    told = result(friction_needed=0.54).model_copy(update={"friction": 0.8})
    assert verdict(told).startswith("right felt left drag with 2.97 N, half of it 193 ms later.")
    assert "drag felt" in shown(told)
    assert "slips" not in shown(told)


def test_a_finger_that_slips_is_told_with_what_it_would_take() -> None:
    nothing = {"truth_from_others_n": None, "force_error": None}
    told = result(nothing, friction_needed=0.54, **nothing).model_copy(update={"friction": 0.4})
    assert "right's finger slips at a friction of 0.4: to stick it needs 0.54" in shown(told)
    assert "left's finger" not in shown(told)
    assert "Every force came to rest, and there is no truth to it" in verdict(told)


def test_a_finger_that_is_pulled_off_could_not_stick_at_all() -> None:
    told = result(friction_needed=1e9, force_error=None).model_copy(update={"friction": 0.4})
    assert "no finger could stick" in shown(told)


def test_what_is_not_known_is_a_question() -> None:
    nothing = {"felt_from_others_n": None, "force_error": None, "felt_onset_ms": None,
               "felt_delay_ms": None, "felt_most_ms": None, "stable": None,
               "rest": None}  # fmt: skip
    told = result(nothing, **nothing).model_copy(update={"presses": 0})
    assert verdict(told) == (
        f"Too short to tell: no whole press was seen {HOW}. Let it run for 9 s: --duration 9."
    )
    hurried = result(rest=None, stable=None)
    assert verdict(hurried).startswith("Too short to tell: not every force had the time to rest")
    # The first hand has nothing to wait for.
    assert shown(told).count("?") == 4 + 4


def test_a_machine_that_cannot_keep_up_is_told_so() -> None:
    assert verdict(result(patch_hz=30.0)).startswith(
        "This machine cannot keep up with 2 users: patches came at 30 of 60 Hz."
    )
    assert verdict(result(patch_hz=50.0)).startswith("right felt left press")


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
    for told in (busy, wavering):
        assert told.shows_it
        assert not told.proves_it


def test_a_busy_machine_is_told_beside_a_force_that_came_to_rest() -> None:
    told = result(loop_stall_ms=35.0).model_copy(update={"late": Blame.MACHINE})
    assert verdict(told).endswith(f"Every force came to rest, at most 0.0% from the truth {HOW}.")
    assert "busy: the haptic loop of right stood still for 35 ms" in shown(told)


def test_a_script_may_ask_for_a_force_that_is_where_it_should_be() -> None:
    assert result().proves_it
    assert not result(force_error=0.06).proves_it
    assert not result(rest=Rest.SLOW).proves_it
    assert not result(rest=None, stable=None).proves_it


def test_what_switched_a_force_off_is_told() -> None:
    text = shown(result(faults=("the hand moved at 3 m/s, more than 2",)))
    assert "force was off for a while: right: the hand moved" in text


@pytest.mark.parametrize("width", [80, 100, 120, 160])
def test_it_fits_into_every_terminal(width: int) -> None:
    text = shown(result(), width)
    assert max(map(len, text.splitlines())) <= width
    assert "…" not in text
