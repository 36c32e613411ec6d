"""Runs the tests in tiers: `python tools/suite.py test|all|night [arguments of pytest]`.

A tier is a list of phases, each a run of pytest with marks of its own (CONTRIBUTING.md). Every
phase runs, also after one that failed. The last lines list all failures of all phases, and the
tests that passed only when they were tried again.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[1]
NO_TESTS = 5  # pytest's status where the arguments name no test of this phase
STOPPED = 2  # and where Ctrl-C ended it
BESIDE = ("-n", os.environ.get("JOBS", "auto"), "--dist", "worksteal")
# What is live depends on the machine and on what else runs there: it may be tried three times.
AGAIN = ("--reruns", "2")


@dataclass(frozen=True, slots=True)
class Phase:
    """One run of pytest.

    Args:
        name: As it is printed.
        marks: Expression of the marks of its tests.
        options: Further arguments of pytest.
        hypothesis: Profile of the laws (tests/conftest.py).
    """

    name: str
    marks: str
    options: tuple[str, ...] = ()
    hypothesis: str = "quick"


SMOKE = Phase("live smoke", "smoke", AGAIN)
TIERS = {
    "test": (
        Phase("laws, in virtual time", "not (slow or live or alone or night)", BESIDE),
        SMOKE,
    ),
    "all": (
        Phase("laws, in virtual time", "not (live or alone or night)", BESIDE, "usual"),
        Phase("live, side by side", "live and not (alone or night)", (*BESIDE, *AGAIN), "usual"),
        Phase("live, one at a time", "alone and not night", AGAIN, "usual"),
    ),
    "night": (Phase("at night", "night", ("--timeout", "3600"), "deep"),),
}


@dataclass(frozen=True, slots=True)
class Outcome:
    """What became of a phase.

    Args:
        phase: Its name.
        status: Of pytest.
        failed: Tests that failed, or could not be collected.
        flaky: Tests that failed and passed when they were tried again.
    """

    phase: str
    status: int
    failed: tuple[str, ...]
    flaky: tuple[str, ...]


def read(phase: str, status: int, lines: Sequence[str]) -> Outcome:
    """The outcome of a phase, from the lines that `outcomes.py` wrote.

    Args:
        phase: Its name.
        status: Of pytest.
        lines: A JSON list `[test, outcome]` each.
    """
    found: dict[str, set[str]] = {}
    for line in lines:
        test, outcome = json.loads(line)
        found.setdefault(outcome, set()).add(test)
    failed = found.get("failed", set())
    return Outcome(
        phase, status, tuple(sorted(failed)), tuple(sorted(found.get("rerun", set()) - failed))
    )


def summary(outcomes: Sequence[Outcome]) -> list[str]:
    """Lines that end the output: flaky tests, then failures, then a verdict."""
    lines = [f"FLAKY  {test}   ({o.phase})" for o in outcomes for test in o.flaky]
    lines += [f"FAILED {test}   ({o.phase})" for o in outcomes for test in o.failed]
    # A process that died, or an error of pytest's own, names no test.
    lines += [
        f"FAILED {o.phase}: pytest ended with {o.status}"
        for o in outcomes
        if o.status not in (0, NO_TESTS) and not o.failed
    ]
    tests, phases = sum(len(o.failed) for o in outcomes), status_of(outcomes)
    verdict = "all phases passed" if phases == 0 else f"{tests} tests failed"
    return [*lines, f"{verdict}, {sum(len(o.flaky) for o in outcomes)} were tried again"]


def status_of(outcomes: Sequence[Outcome]) -> int:
    """Exit status of the whole: 0, or 1 where any phase failed or none found a test."""
    states = {o.status for o in outcomes}
    return 0 if states <= {0, NO_TESTS} and 0 in states else 1


def run(phase: Phase, arguments: Sequence[str]) -> Outcome:
    """Run one phase; its output goes where ours goes."""
    print(f"\n== {phase.name} (-m {phase.marks!r})", flush=True)
    # Plugins are imported before pytest reads its own paths.
    path = os.pathsep.join(filter(None, (str(Path(__file__).parent), os.environ.get("PYTHONPATH"))))
    # Without bytecode each process would compile every module, and rewrite every test, anew.
    kept = {name: v for name, v in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    with tempfile.TemporaryDirectory() as folder:
        outcomes = Path(folder) / "outcomes"
        outcomes.touch()
        done = subprocess.run(
            [
                sys.executable, "-m", "pytest", "-c", str(ROOT / "pyproject.toml"),
                "-p", "outcomes", "--outcomes", str(outcomes),
                "-m", phase.marks, *phase.options, *arguments,
            ],
            cwd=ROOT,
            env={**kept, "HYPOTHESIS_PROFILE": phase.hypothesis, "PYTHONPATH": path},
            check=False,
        )  # fmt: skip
        return read(phase.name, done.returncode, outcomes.read_text(encoding="utf-8").splitlines())


def run_tier(
    phases: Sequence[Phase],
    arguments: Sequence[str],
    one: Callable[[Phase, Sequence[str]], Outcome] = run,
) -> list[Outcome]:
    """Run phase after phase, whatever became of those before, until Ctrl-C."""
    outcomes: list[Outcome] = []
    for phase in phases:
        outcomes.append(one(phase, arguments))
        if outcomes[-1].status == STOPPED and not outcomes[-1].failed:
            break
    return outcomes


def main(tier: str, *arguments: str) -> int:
    """Run a tier and print its summary; returns the exit status."""
    outcomes = run_tier(TIERS[tier], arguments)
    print("\n" + "\n".join(summary(outcomes)), flush=True)
    return status_of(outcomes)


if __name__ == "__main__":
    try:
        sys.exit(main(*sys.argv[1:]))
    except KeyboardInterrupt:
        sys.exit(130)
