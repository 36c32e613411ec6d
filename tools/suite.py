"""Runs the tests in tiers: `python tools/suite.py test|all|night [arguments of pytest]`.

A tier is a list of phases, each a run of pytest with marks of its own (CONTRIBUTING.md). Every
phase runs, also after one that failed. The last lines list all failures of all phases, and the
tests that passed only when they were tried again.
"""

from __future__ import annotations

import contextlib
import json
import os
import signal
import subprocess
import sys
import tempfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[1]
NO_TESTS = 5  # pytest's status where the arguments name no test of this phase
STOPPED = 130  # of a shell's commands that Ctrl-C ends
TIMEOUT = 300.0  # s for one test, as in pyproject.toml; a test may wait three times its patience
JOBS = os.environ.get("JOBS", "auto")
BESIDE = ("-n", JOBS, "--dist", "worksteal")
# A live test mostly waits: one process more than there are cores. Those with a browser share two.
WAITING = ("-n", JOBS if JOBS.isdigit() else str(1 + (os.cpu_count() or 1)), "--dist", "loadscope")
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


LAWS = Phase("laws, in virtual time", "not (live or alone or night)", BESIDE)
SMOKE = Phase("live smoke", "smoke", AGAIN)
TIERS = {
    "test": (LAWS, SMOKE),
    "all": (
        LAWS,
        Phase("live, side by side", "live and not (alone or night)", (*WAITING, *AGAIN)),
        Phase("live, one at a time", "alone and not night", AGAIN),
    ),
    "night": (
        Phase("laws, on new examples", "not (live or alone or night)", BESIDE, "deep"),
        Phase("at night", "night", (), "deep"),
    ),
}


@dataclass(frozen=True, slots=True)
class Outcome:
    """What became of a phase.

    Args:
        phase: Its name.
        status: Status of pytest.
        failed: Tests that failed, or could not be collected, and why, in a line.
        flaky: Tests that failed and passed when they were tried again, and why they failed first.
        stopped: Whether Ctrl-C ended it.
    """

    phase: str
    status: int
    failed: Mapping[str, str]
    flaky: Mapping[str, str]
    stopped: bool = False


def read(phase: str, status: int, lines: Sequence[str]) -> Outcome:
    """The outcome of a phase, from the lines that `outcomes.py` wrote.

    Args:
        phase: Its name.
        status: Status of pytest.
        lines: A JSON list `[test, outcome, why]` each.
    """
    found: dict[str, dict[str, str]] = {"failed": {}, "rerun": {}, "stopped": {}}
    for line in lines:
        test, outcome, why = json.loads(line)
        found[outcome].setdefault(test, why)
    failed = found["failed"]
    flaky = {test: why for test, why in found["rerun"].items() if test not in failed}
    return Outcome(phase, status, failed, flaky, bool(found["stopped"]))


def summary(outcomes: Sequence[Outcome], *, a_part: bool = False) -> list[str]:
    """Lines that end the output: flaky tests, then failures, then a verdict.

    Args:
        outcomes: Outcomes of the phases that ran.
        a_part: Whether arguments chose tests, so that a phase may have none.
    """
    reported = [("FLAKY ", o.phase, o.flaky) for o in outcomes]
    reported += [("FAILED", o.phase, o.failed) for o in outcomes]
    lines = [
        f"{word} {test}   ({phase}: {why})"
        for word, phase, tests in reported
        for test, why in sorted(tests.items())
    ]
    # A process that died, or an error of pytest's own, names no test.
    lines += [
        f"FAILED {o.phase}: {'stopped' if o.stopped else f'pytest ended with {o.status}'}"
        for o in outcomes
        if o.status not in ((0, NO_TESTS) if a_part else (0,)) and not o.failed
    ]
    tests, status = sum(len(o.failed) for o in outcomes), status_of(outcomes, a_part=a_part)
    verdict = "all phases passed" if status == 0 else f"{tests} tests failed"
    return [*lines, f"{verdict}, {sum(len(o.flaky) for o in outcomes)} were tried again"]


def status_of(outcomes: Sequence[Outcome], *, a_part: bool = False) -> int:
    """Exit status of the whole: 0, or 1 where a phase failed or had no test.

    Where arguments chose tests, a phase may have none, but not all of them.
    """
    if any(o.stopped for o in outcomes):
        return STOPPED
    states = {o.status for o in outcomes}
    return 0 if states == {0} or (a_part and states == {0, NO_TESTS}) else 1


def run(phase: Phase, arguments: Sequence[str]) -> Outcome:
    """Run one phase; its output goes where ours goes."""
    print(f"\n== {phase.name} (-m {phase.marks!r})", flush=True)
    # Plugins are imported before pytest reads its own paths.
    path = os.pathsep.join(filter(None, (str(Path(__file__).parent), os.environ.get("PYTHONPATH"))))
    # Without bytecode each process would compile every module, and rewrite every test, anew.
    kept = {name: v for name, v in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    longer = 12.0 if phase.hypothesis == "deep" else 1.0
    limit = longer * TIMEOUT * float(os.environ.get("COHAPTIC_PATIENCE", "1"))
    with tempfile.TemporaryDirectory() as folder:
        outcomes = Path(folder) / "outcomes"
        outcomes.touch()
        with subprocess.Popen(
            [
                sys.executable, "-m", "pytest", "-c", str(ROOT / "pyproject.toml"),
                "-p", "outcomes", "--outcomes", str(outcomes),
                "--timeout", f"{limit:g}", "-m", phase.marks, *phase.options, *arguments,
            ],
            cwd=ROOT,
            env={**kept, "HYPOTHESIS_PROFILE": phase.hypothesis, "PYTHONPATH": path},
        ) as process:  # fmt: skip

            def stop(_number: int, _frame: object) -> None:
                process.send_signal(signal.SIGINT)

            signal.signal(signal.SIGTERM, stop)
            while process.returncode is None:
                # Ctrl-C goes to pytest too, which tidies up what its tests have started.
                with contextlib.suppress(KeyboardInterrupt):
                    process.wait()
        lines = outcomes.read_text(encoding="utf-8").splitlines()
        return read(phase.name, process.returncode, lines)


def run_tier(
    phases: Sequence[Phase],
    arguments: Sequence[str],
    one: Callable[[Phase, Sequence[str]], Outcome] = run,
) -> list[Outcome]:
    """Run phase after phase, whatever became of those before, until Ctrl-C."""
    outcomes: list[Outcome] = []
    for phase in phases:
        outcomes.append(one(phase, arguments))
        if outcomes[-1].stopped:
            break
    return outcomes


def main(tier: str, *arguments: str) -> int:
    """Run a tier and print its summary; returns the exit status."""
    if "-m" in arguments:
        print("marks choose the tier; choose tests by their files or by -k", file=sys.stderr)
        return 2
    outcomes = run_tier(TIERS[tier], arguments)
    # Options alone, such as -q or -x, choose no tests.
    a_part = any(not argument.startswith("-") for argument in arguments) or "-k" in arguments
    print("\n" + "\n".join(summary(outcomes, a_part=a_part)), flush=True)
    return status_of(outcomes, a_part=a_part)


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
