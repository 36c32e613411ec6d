"""Every experiment in its quick form, and the frame round them."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from matplotlib.figure import Figure

import cohaptic.cli.app
from cohaptic.errors import SettingError
from cohaptic_experiments import catalogue
from cohaptic_experiments.catalogue import EXPERIMENTS, Experiment, LibraryMissing, choose, load
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
    part,
)
from cohaptic_experiments.report import summary
from tests.experiments.quick_run import check_quick_run

PNG = b"\x89PNG"


def outcome(*checks: Check) -> Outcome:
    numbers: dict[str, Number] = {"x": float("nan"), "y": [1.0, float("inf")], "z": "text"}
    return Outcome(Figure(), Table(("a", "b"), [(1.0, None)]), numbers, checks)


# "hands" is run beside the tests of its campaign: one process compiles its kernel for all of them.
@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name in EXPERIMENTS if name != "hands"])
def test_an_experiment_holds_and_writes_its_outcome(name: str, tmp_path: Path) -> None:
    check_quick_run(name, tmp_path)


@pytest.mark.slow
def test_the_same_seed_gives_the_same_data() -> None:
    ext2 = load("ext2")
    first, again, other = (
        ext2.run(Options(seed=s, quick=True), lambda _: None).table.rows for s in (1, 1, 2)
    )
    assert first == again
    assert first != other


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


def test_all_runs_every_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    ran: list[str] = []

    def loaded(name: str) -> Experiment:
        ran.append(name)
        return Experiment(name, "of a test", lambda _, __: outcome(at_most("fine", 0.0, 1.0)))

    monkeypatch.setattr("cohaptic_experiments.cli.load", loaded)
    with pytest.raises(SystemExit) as ended:
        cohaptic.cli.app.main(["experiment", "all", "--out", str(tmp_path)])
    assert ended.value.code == 0
    assert tuple(ran) == EXPERIMENTS
    assert {p.name for p in tmp_path.iterdir()} == set(EXPERIMENTS)


def test_an_unknown_name_is_told_the_names(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as ended:
        cohaptic.cli.app.main(["experiment", "fig99", "--out", str(tmp_path)])
    assert ended.value.code == 2
    said = capsys.readouterr().err
    assert "fig99" in said
    for name in EXPERIMENTS:
        assert name in said
    with pytest.raises(SettingError):
        choose("FIG08")


def test_a_file_in_place_of_the_folder_is_said_so(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "taken"
    file.write_text("")
    with pytest.raises(SystemExit) as ended:
        cohaptic.cli.app.main(["experiment", "fig07a", "--out", str(file), "--quick"])
    assert ended.value.code == 2
    assert str(file) in capsys.readouterr().err


@pytest.mark.parametrize("library", ["matplotlib.figure", "numba"])
def test_a_missing_library_comes_with_advice(
    library: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    def missing(name: str) -> object:
        raise ModuleNotFoundError(f"No module named {library!r}", name=library)

    monkeypatch.setattr(catalogue, "import_module", missing)
    with pytest.raises(LibraryMissing):
        load("fig08")
    with pytest.raises(SystemExit) as ended:
        cohaptic.cli.app.main(["experiment", "fig08", "--out", str(tmp_path)])
    assert ended.value.code == 2
    assert 'pip install "cohaptic[experiments]"' in capsys.readouterr().err


def test_another_missing_module_is_a_bug_and_stays_one(monkeypatch: pytest.MonkeyPatch) -> None:
    def missing(name: str) -> object:
        raise ModuleNotFoundError("No module named 'x'", name="x")

    monkeypatch.setattr(catalogue, "import_module", missing)
    with pytest.raises(ModuleNotFoundError):
        load("fig08")


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


def test_numbers_that_are_none_become_null() -> None:
    experiment = Experiment("x", "title", lambda _, __: outcome())
    said = summary(experiment, Options(quick=True), outcome(at_most("", float("nan"), 1.0)))
    text = json.dumps(said, allow_nan=False)
    assert json.loads(text)["numbers"] == {"x": None, "y": [1.0, None], "z": "text"}
    assert str(said["command"]).endswith("--quick")


def test_progress_of_a_part() -> None:
    seen: list[float] = []
    part(seen.append, 0.5, 0.25)(0.4)
    assert seen == [pytest.approx(0.6)]
