from __future__ import annotations

import json
import math
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


def test_several_contacts() -> None:
    answer = ask(
        "--law", "proportional", "--compliance", "[[1, 0.3], [0.3, 1]]", "--k-h", "[0.9, 0.9]"
    )
    assert answer["rho_no_delay"] == pytest.approx(1.17)
    assert answer["rho_any_delay"] == pytest.approx(1.17)
    assert answer["stable_any_delay"] is False
    assert answer["safe_k_h"] == pytest.approx([0.9 / 1.3] * 2)


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
