"""A plugin of pytest that writes which tests failed or were run again, for `suite.py`."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, cast

import pytest


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add `--outcomes FILE`."""
    parser.addoption("--outcomes", type=Path, help="append what failed or was run again, as JSON")


def pytest_configure(config: pytest.Config) -> None:
    """Write in the process that reports, not in its workers."""
    path: Path | None = config.option.outcomes
    if path is not None and not hasattr(config, "workerinput"):
        config.pluginmanager.register(Outcomes(path))


class Outcomes:
    """Appends to a file."""

    def __init__(self, path: Path) -> None:
        self._path = path

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Take note of a test; `rerun` is an outcome of pytest-rerunfailures."""
        self._write(report.nodeid, report.outcome, _why(report))

    def pytest_collectreport(self, report: pytest.CollectReport) -> None:
        """Take note of a file that could not be imported."""
        self._write(report.nodeid, report.outcome, _why(report))

    def pytest_keyboard_interrupt(self) -> None:
        """Take note of Ctrl-C, which ends the whole tier."""
        self._write("", "stopped", "")

    def _write(self, test: str, outcome: str, why: str) -> None:
        if outcome in ("failed", "rerun", "stopped"):
            with self._path.open("a", encoding="utf-8") as lines:
                lines.write(json.dumps([test, outcome, why]) + "\n")


def _why(report: pytest.TestReport | pytest.CollectReport) -> str:
    """Where a test failed and with which words, in one line; empty where it did not."""
    crash: Any = getattr(report.longrepr, "reprcrash", None)
    if crash is None:
        return next(reversed(report.longreprtext.strip().splitlines()), "")
    words = next(iter(str(crash.message).splitlines()), "")
    # The line of the test tells more than that of a helper in which it waited.
    first: Any = cast(Any, report.longrepr).reprtraceback.reprentries[0]
    where = getattr(first, "reprfileloc", None) or crash
    return f"{Path(where.path).name}:{where.lineno}: {words}"
