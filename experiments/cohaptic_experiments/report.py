"""An outcome as files and as a table on the terminal."""

from __future__ import annotations

import csv
import io
import json
import math
from pathlib import Path
from typing import NamedTuple

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table as Shown
from rich.text import Text

from cohaptic import __version__
from cohaptic.cli.output import Output, new_output
from cohaptic.errors import SettingError
from cohaptic_experiments.catalogue import Experiment
from cohaptic_experiments.outcome import Check, Number, Options, Outcome


def progress_bar() -> Progress:
    """A bar that vanishes when the work is done, on the stream of errors."""
    return Progress(
        TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn(),
        console=Console(stderr=True), transient=True,
    )  # fmt: skip


class Files(NamedTuple):
    """The files of one experiment."""

    figure: Output
    data: Output
    summary: Output


def files(folder: Path, *, overwrite: bool) -> Files:
    """Return the files of an experiment, before it is run.

    Args:
        folder: Folder of this experiment; made when it is not there.
        overwrite: Whether the files may replace others.

    Raises:
        SettingError: One of them exists and must not be replaced, or they cannot be written.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        problem = f"{folder} ({error.strerror or error})"
        raise SettingError("--out", problem, "a folder that can be written") from error
    found = [new_output("--out", folder / name, overwrite=overwrite) for name in _NAMES]
    return Files(*filter(None, found))


_NAMES = ("figure.png", "data.csv", "summary.json")


def write(experiment: Experiment, options: Options, outcome: Outcome, to: Files) -> None:
    """Write figure.png, data.csv and summary.json.

    Args:
        experiment: The experiment.
        options: Those of the run.
        outcome: Outcome of the experiment.
        to: The files.

    Raises:
        OutputError: One of them cannot be written.
    """
    figure = outcome.figure
    to.figure.write_by(lambda png: figure.savefig(png, format="png"))  # pyright: ignore[reportUnknownMemberType]
    table = io.StringIO()
    rows = csv.writer(table)
    rows.writerow(outcome.table.columns)
    rows.writerows([_cell(value) for value in row] for row in outcome.table.rows)
    to.data.write(table.getvalue())
    text = json.dumps(summary(experiment, options, outcome), indent=2, allow_nan=False)
    to.summary.write(text + "\n")


def summary(experiment: Experiment, options: Options, outcome: Outcome) -> dict[str, object]:
    """The content of summary.json; NaN and infinite numbers become null."""
    command = f"cohaptic experiment {experiment.name} --out DIR --seed {options.seed}"
    return {
        "name": experiment.name,
        "title": experiment.title,
        "seed": options.seed,
        "verdict": verdict(outcome),
        "checks": [
            {
                "sentence": check.sentence,
                "measured": _finite(check.measured),
                "at_least": _finite(check.low),
                "at_most": _finite(check.high),
                "passed": check.passed,
            }
            for check in outcome.checks
        ],
        "numbers": {name: _json(value) for name, value in outcome.numbers.items()},
        "command": command + (" --quick" if options.quick else ""),
        "version": __version__,
    }


def verdict(outcome: Outcome) -> str:
    """The verdict in words."""
    return "holds" if outcome.holds else "does not hold"


def show(experiment: Experiment, outcome: Outcome) -> Shown:
    """Checks and verdict as a table for the terminal."""
    title = Text(f"{experiment.name}: {experiment.title}")
    shown = Shown(title=title, title_justify="left", show_lines=False)
    shown.add_column("check")
    shown.add_column("measured", justify="right", no_wrap=True)
    shown.add_column("limit", justify="right", no_wrap=True)
    shown.add_column("", no_wrap=True)
    for check in outcome.checks:
        passed = Text("yes", "green") if check.passed else Text("NO", "bold red")
        shown.add_row(Text(check.sentence), f"{check.measured:.4g}", limit(check), passed)
    shown.caption = verdict(outcome)
    return shown


def limit(check: Check) -> str:
    """The limits of a check in words."""
    if check.low == -math.inf:
        return f"at most {check.high:.4g}"
    if check.high == math.inf:
        return f"at least {check.low:.4g}"
    return f"{check.low:.4g} to {check.high:.4g}"


def _cell(value: float | int | str | None) -> str:
    """One value of the table, with seven digits, more than any result is accurate to."""
    return f"{value:.7g}" if isinstance(value, float) else "" if value is None else str(value)


def _finite(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None


def _json(value: Number) -> Number:
    """The value as JSON can represent it."""
    if isinstance(value, list):
        return [None if v is None else _finite(float(v)) for v in value]
    return _finite(value) if isinstance(value, float) else value
