"""Every experiment in its quick form, and the frame round them."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from matplotlib.figure import Figure

import cohaptic.cli.app
from cohaptic_experiments.catalogue import EXPERIMENTS, Experiment
from cohaptic_experiments.outcome import (
    Check,
    Number,
    Options,
    Outcome,
    Progress,
    Table,
    at_least,
    at_most,
    near,
)
from tests.experiments.quick_run import check_quick_run


def outcome(*checks: Check) -> Outcome:
    numbers: dict[str, Number] = {"x": float("nan"), "y": [1.0, float("inf")], "z": "text"}
    return Outcome(Figure(), Table(("a", "b"), [(1.0, None)]), numbers, checks)


# Each takes ten seconds and more, also in its quick form.
LONG = {"crowd", "delay", "ext2", "fig08", "slide"}


# "hands" is run beside the tests of its campaign: one process compiles its kernel for all of them.
@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=[pytest.mark.night] if name in LONG else [])
        for name in EXPERIMENTS
        if name != "hands"
    ],
)
def test_an_experiment_holds_and_writes_its_outcome(name: str, tmp_path: Path) -> None:
    check_quick_run(name, tmp_path)


def test_a_verdict_that_does_not_hold_ends_with_1(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def run(options: Options, progress: Progress) -> Outcome:
        progress(1.0)
        return outcome(at_most("too much", 2.0, 1.0), at_most("fine", 0.0, 1.0))

    def loaded(name: str) -> Experiment:
        return Experiment(name, "of a test", run)

    monkeypatch.setattr("cohaptic_experiments.cli.load", loaded)
    with pytest.raises(SystemExit) as ended:
        cohaptic.cli.app.main(["experiment", "fig08", "--out", str(tmp_path)])
    assert ended.value.code == 1
    assert json.loads((tmp_path / "fig08/summary.json").read_text())["verdict"] == "does not hold"
    assert "does not hold: fig08" in capsys.readouterr().out


def test_checks_fail_on_either_side_and_on_no_number() -> None:
    assert at_most("", 1.0, 1.0).passed
    assert not at_most("", 1.01, 1.0).passed
    assert at_least("", 1.0, 1.0).passed
    assert not at_least("", 0.99, 1.0).passed
    assert near("", 10.1, 10.0, 0.02).passed
    assert not near("", 10.3, 10.0, 0.02).passed
    assert not near("", 9.7, 10.0, 0.02).passed
    for check in (at_most, at_least):
        assert not check("", float("nan"), 1.0).passed


def test_no_checks_prove_nothing() -> None:
    assert not outcome().holds
    assert outcome(at_most("", 0.0, 1.0)).holds
    assert not outcome(at_most("", 0.0, 1.0), at_most("", 2.0, 1.0)).holds
