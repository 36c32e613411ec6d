from __future__ import annotations

import json
import math
import subprocess
import sys
from typing import Any

import pytest
from typer import Typer
from typer.testing import CliRunner

from cohaptic.cli.stability import stability
from cohaptic.errors import SettingError

pytestmark = pytest.mark.live

APP = Typer()
APP.command()(stability)


def ask(*arguments: object) -> Any:
    result = CliRunner().invoke(APP, [*map(str, arguments), "--json", "-"], catch_exceptions=False)
    assert result.exit_code == 0
    return json.loads(result.stdout)


@pytest.mark.parametrize(("k_h", "stable"), [(190, True), (220, False)])
@pytest.mark.parametrize("delay", [0.0, 0.013, 0.25])
def test_figures_7b_and_7c(k_h: float, stable: bool, delay: float) -> None:
    """K_o = 0.2 N/mm at 20 Hz: stable at 0.19, unstable at 0.22, and so at every delay (3.1)."""
    answer = ask(
        "--law", "proportional", "--k-o", 200, "--k-h", k_h, "--sim-period", 0.05, "--delay", delay
    )
    assert answer["stable"] is stable
    assert answer["closed_condition"] is stable


def test_figure_9_and_the_effect_of_delay_on_it() -> None:
    """I = 0.003 N/(mm ms) = 3000 N/(m s): read with the unit printed it would settle in minutes."""
    figure = ["--law", "pi", "--k-o", 300, "--k-h", 100, "--integral-gain", 3000]
    near = ask(*figure, "--sim-period", 0.05)
    assert near["stable"] is near["closed_condition"] is True
    assert near["felt_stiffness"] == 300
    far = ask(*figure, "--sim-period", 0.05, "--delay", 0.3)
    assert far["stable"] is False
    assert far["closed_condition"] is None


@pytest.mark.parametrize("delay", [0.0, 0.05, 0.013])
def test_the_area_is_a_polygon_round_the_stable_gains(delay: float) -> None:
    answer = ask("--law", "pi", "--k-o", 300, "--sim-period", 0.05, "--delay", delay, "--area")
    corners = answer["area"]
    assert corners[0] == corners[-1]
    assert len(corners) > 20
    top = max(i for _, i in corners)
    if delay == 0.0:
        assert top == pytest.approx(4.0 * 300 / 0.05, rel=0.05)
    else:
        assert 0.0 < top < 3.0 * 300 / 0.05


def test_predictive_is_stable_alone_at_any_delay() -> None:
    answer = ask("--law", "predictive", "--k-o", 250, "--k-h", 250, "--delay", 0.5)
    assert (answer["stable"], answer["spectral_radius"]) == (True, 0.0)


def test_several_contacts() -> None:
    answer = ask(
        "--law", "proportional", "--compliance", "[[1, 0.3], [0.3, 1]]", "--k-h", "[0.9, 0.9]"
    )
    assert answer["rho_no_delay"] == pytest.approx(1.17)
    assert answer["rho_any_delay"] == pytest.approx(1.17)
    assert answer["stable_any_delay"] is False
    assert answer["safe_k_h"] == pytest.approx([0.9 / 1.3] * 2)


def test_several_contacts_with_an_integral_have_no_bound_for_any_delay() -> None:
    """An integral is stable for the delays it was chosen for; --delay says which."""
    room = ["--law", "pi", "--compliance", "[[0.004, 0.001], [0.001, 0.004]]", "--k-h", "60"]
    slow = ask(*room, "--integral-gain", 500)
    assert slow["rho_no_delay"] < 1.0
    assert (slow["rho_any_delay"], slow["stable_any_delay"]) == (None, False)
    assert ask(*room, "--integral-gain", 50_000)["rho_no_delay"] > 1.0
    near, far = (ask(*room, "--delay", d)["safe_integral_gain"] for d in (0.0, 0.5))
    assert 0.0 < far[0] < near[0]


CLOSE = "[[0.004, 0.0032, 0.0032], [0.0032, 0.004, 0.0032], [0.0032, 0.0032, 0.004]]"


def test_several_contacts_of_the_predictive_law_are_told_the_lag_that_makes_them_stable() -> None:
    """Full stiffness for all, m = 1.6; the row rule would have left 0.9 / 1.6 of it."""
    answer = ask("--compliance", CLOSE, "--k-h", 250, "--delay", 0.1, "--sim-period", 0.02)
    assert answer["safe_k_h"] == pytest.approx([250.0] * 3)
    assert answer["safe_integral_gain"] == [0.0] * 3
    assert answer["coupling"] == pytest.approx(1.6)
    edge = math.sqrt(1.6**2 - 1.0) / math.acos(-1.0 / 1.6)
    assert answer["lag_needed"] == pytest.approx(0.14 * edge)
    assert answer["stable_any_delay"] is False  # without a lag
    other = ask("--compliance", CLOSE, "--law", "proportional", "--k-h", 50)
    assert "lag_needed" not in other


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--delays", "[0.1]"], "delays is [0.1]; it must be left out without --compliance"),
        (["--lag", "0.1"], "lag is 0.1; it must be left out without --compliance"),
        (["--compliance", "[[1]]", "--lag", "0.1"], "lag is 0.1; it must be left out without"),
        (["--compliance", "5"], "of shape ()"),
        (["--compliance", "[[1" + "0" * 400 + "]]"], "compliance is"),
        (["--compliance", "[" * 100_000], "compliance is"),
        (["--compliance", "[[1]]", "--integral-gain", "5"], "has no integral"),
        (["--k-o", "0"], "k_o is 0"),
        (["--k-h", "nan"], "k_h is 'nan'"),
        (["--k-h", "[1, 2]"], "one number"),
        (["--delay", "-1"], "delay is -1"),
        (["--delay", "1e9"], "10,000 samples"),
        (["--compliance", "[[1]"], "compliance is '[[1]'"),
        (["--compliance", '["a"]'], "compliance is"),
        (["--compliance", "[[1, 2], [2, 1]]", "--k-h", "[1, 1]"], "positive definite"),
        (["--compliance", "[[1]]", "--sim-period", "0"], "simulation period is 0"),
    ],
)
def test_rubbish_is_named(arguments: list[str], words: str) -> None:
    with pytest.raises(SettingError) as caught:
        CliRunner().invoke(APP, arguments, catch_exceptions=False)
    assert words in str(caught.value)


def test_on_the_command_line_trouble_is_one_sentence() -> None:
    run = [sys.executable, "-m", "cohaptic", "stability", "--delay", "-1"]
    done = subprocess.run(run, capture_output=True, text=True)
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1
    assert "delay is -1" in done.stderr


def test_for_a_person_it_is_a_table() -> None:
    shown = CliRunner().invoke(APP, ["--law", "proportional", "--k-h", "300"]).stdout
    assert "stable" in shown
    assert "NO" in shown


def test_a_file_that_cannot_be_written_is_told_before_the_work() -> None:
    with pytest.raises(SettingError, match=r"--json is no/such/x.json; it must be a file in a"):
        stability(json_to="no/such/x.json")


C = "[[0.005, 0.002], [0.002, 0.004]]"


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--law", "pi", "--integral-gain", "300", "--area"], ["felt at rest", "200 N/m"]),
        (["--law", "pi", "--compliance", C, "--delay", "0.1"], ["safe I", "558.4, 651.5 N/(m s)"]),
        (["--compliance", "[[0.01, 0], [0, 0.01]]", "--delays", "0.1"], ["without bound"]),
        (["--compliance", C, "--delays", "[0.1, 0.2]"], ["growth of the fastest motion", " 1/s"]),
        (["--compliance", C, "--delays", "0.1", "--lag", "0.05"], ["lag of the room", "50 ms"]),
    ],
)
def test_people_read_words_with_units(arguments: list[str], said: list[str]) -> None:
    """And programs the keys."""
    answer = ask(*arguments)
    shown = CliRunner().invoke(APP, arguments, catch_exceptions=False).stdout
    assert len(shown.splitlines()) == len(answer) - (answer.get("closed_condition", 0) is None)
    assert all(len(line.rstrip()) <= 80 for line in shown.splitlines())
    assert all(part in shown for part in said)
    assert "_" not in shown.replace("K_h", "")
