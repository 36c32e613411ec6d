"""What pytest does for mutants, in the process of the tests: `pytest -p mutant_plugin`.

Under coverage each line is put down to the test that runs it. Lines of processes that a test starts
come to it by the environment, as far as they end by themselves or by SIGTERM and were not forked
without a new start of Python.
"""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Generator
from importlib.util import find_spec
from pathlib import Path

import pytest
from coverage import Coverage

TEST = "MUTANT_TEST"  # the test that runs; the settings of coverage read it in new processes
CHOSEN = "MUTANT_CHOSEN"  # a file with the names of the tests to run, one a line
MODULE = "MUTANT_MODULE"  # the module with the fault
REPORT = "MUTANT_REPORT"  # a file to write: see `Report`
SETUP = "|setup"  # behind the name of a test: what its fixtures ran, maybe for others too


class Report:
    """What has happened, for the file that `REPORT` names.

    Attributes:
        collected: Names of the tests that were chosen.
        tests: Seconds and outcome of each test that was run, in this order.
    """

    def __init__(self) -> None:
        self.collected: list[str] = []
        self.tests: dict[str, tuple[float, str]] = {}

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Add one of the three phases of a test; the worst outcome counts."""
        seconds, outcome = self.tests.get(report.nodeid, (0.0, "passed"))
        worse = outcome if report.outcome == "passed" or outcome == "failed" else report.outcome
        self.tests[report.nodeid] = (seconds + report.duration, worse)

    @pytest.hookimpl(trylast=True)
    def pytest_collection_modifyitems(
        self, config: pytest.Config, items: list[pytest.Item]
    ) -> None:
        """Keep what was chosen, file after file in the order of the choice."""
        if CHOSEN in os.environ:
            names = Path(os.environ[CHOSEN]).read_text(encoding="utf-8").splitlines()
            files = {name.partition("::")[0]: -i for i, name in reversed([*enumerate(names)])}
            chosen = set(names)
            left_out = [item for item in items if item.nodeid not in chosen]
            config.hook.pytest_deselected(items=left_out)
            items[:] = [item for item in items if item.nodeid in chosen]
            items.sort(key=lambda item: -files[item.nodeid.partition("::")[0]])
        self.collected = [item.nodeid for item in items]

    @pytest.hookimpl(trylast=True)
    def pytest_sessionfinish(self) -> None:
        """Write the report, with the file that the module was really imported from."""
        origin = None
        if name := os.environ.get(MODULE):
            module = sys.modules.get(name)
            spec = module.__spec__ if module else find_spec(name)
            origin = spec.origin if spec else None
        found = {"collected": self.collected, "tests": self.tests, "imported": origin}
        Path(os.environ[REPORT]).write_text(json.dumps(found), encoding="utf-8")


def pytest_configure(config: pytest.Config) -> None:
    """One report of all processes that run tests: the first process hears of every test."""
    if not hasattr(config, "workerinput"):
        config.pluginmanager.register(Report())


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item: pytest.Item) -> Generator[None, object, object]:
    """Lines that run from here on are those of this test."""
    _runs(item.nodeid)
    try:
        return (yield)
    finally:
        _runs("")


@pytest.hookimpl(wrapper=True)
def pytest_runtest_setup(item: pytest.Item) -> Generator[None, object, object]:
    """What fixtures run is marked: other tests of the file may use the same ones."""
    _runs(item.nodeid + SETUP)
    try:
        return (yield)
    finally:
        _runs(item.nodeid)


def _runs(name: str) -> None:
    os.environ[TEST] = name
    coverage = Coverage.current()
    if coverage is not None:
        coverage.switch_context(name)
