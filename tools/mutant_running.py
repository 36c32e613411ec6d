"""Mutants, one after another, against the tests that reach them.

Tiers are sets of tests by their marks. A mutant that a test of one tier has killed is killed in
every tier that has this test, and no test runs twice on the same mutant, so a tier that has all
tests of the one before costs only what it adds.
"""

from __future__ import annotations

import json
import tempfile
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from pathlib import Path
from queue import SimpleQueue
from threading import Lock
from typing import Any

from mutant_checkout import TIMED_OUT, Checkout
from mutant_making import Mutant
from mutant_reach import Reach

# A test may take this much, and this many times what it took under coverage, which slows it down
# already; the session some more, to start and for what cannot be interrupted.
GRACE, SLOWER, START = 10.0, 3.0, 60.0  # [s], -, [s]
PASSED, FAILED, NONE_COLLECTED = 0, 1, 5
TIME_OUT, NO_TESTS = "does not end", "its tests cannot be collected"


def run(
    drawn: Sequence[Mutant],
    sources: Mapping[str, bytes],
    reach: Reach,
    tiers: Mapping[str, str],
    arguments: Sequence[str],
    limit: float,
    file: Path,
    jobs: int,
    root: Path,
) -> None:
    """Run the tests on mutants, and tell of each as it is done.

    Args:
        drawn: The mutants.
        sources: Sources of the modules, by path.
        reach: Who reaches what.
        tiers: An expression for `pytest -m` by the tier's name; empty for all tests.
        arguments: More of pytest's.
        limit: Time that the tests of one mutant took together when they were recorded; others are
            left out, and counted [s].
        file: JSON: by a mutant's name its path, scope, line, before and after, and by tier a state
            (killed, survived, unreached), by whom, how many tests there were to run, and how many
            were left out. Mutants in it are skipped.
        jobs: Mutants at a time, each in a copy of its own.
        root: Root of the checkout.
    """
    results: dict[str, dict[str, Any]] = json.loads(file.read_text()) if file.is_file() else {}
    todo = [m for m in drawn if set(tiers) - set(results.get(m.name, {"tiers": ()})["tiers"])]
    print(f"{len(drawn)} mutants, {len(drawn) - len(todo)} done before", flush=True)
    if not todo:
        return
    with tempfile.TemporaryDirectory() as folder, ThreadPoolExecutor(jobs) as pool:
        runner = Runner(reach, arguments, limit)
        for i in range(jobs):
            runner.free.put(Checkout(root, Path(folder, str(i))))
        members = runner.members(tiers)
        waiting = {
            pool.submit(runner.fate, m, sources[m.path], members, results.get(m.name)): m
            for m in todo
        }
        try:
            for n, done in enumerate(as_completed(waiting), 1):
                mutant, fate = waiting[done], done.result()
                results[mutant.name] = fate
                part = file.with_suffix(".part")
                part.write_text(json.dumps(results, indent=1), encoding="utf-8")
                part.replace(file)
                states = ", ".join(f"{t}: {f['state']} {f['by']}" for t, f in fate["tiers"].items())
                print(f"{n}/{len(todo)} {mutant.path}:{mutant.line} {states}", flush=True)
        finally:
            pool.shutdown(cancel_futures=True)


class Runner:
    """Runs tests on mutants, in as many threads as there are copies in `free`."""

    def __init__(self, reach: Reach, arguments: Sequence[str], limit: float) -> None:
        self.free = SimpleQueue[Checkout]()
        self._limit = limit
        self._reach, self._arguments = reach, [*arguments, "-q", "-x"]
        self._sound: dict[str, bool] = {}  # tests by whether they pass without any fault
        self._reading = Lock()  # the database belongs to one thread at a time

    def members(self, tiers: Mapping[str, str]) -> dict[str, set[str]]:
        """Names of the tests of each tier.

        Raises:
            RuntimeError: pytest cannot collect the recorded tests.
        """
        found: dict[str, set[str]] = {}
        checkout = self.free.get()
        for name, expression in tiers.items():
            chosen = [*self._arguments, "--collect-only", "-m", expression]
            session = checkout.chosen(self._reach.seconds, chosen, limit=10 * START)
            if session.code not in (PASSED, NONE_COLLECTED):
                raise RuntimeError(session.output[-2000:])
            found[name] = set(session.collected)
        self.free.put(checkout)
        return found

    def fate(
        self,
        mutant: Mutant,
        source: bytes,
        members: Mapping[str, set[str]],
        before: dict[str, Any] | None,
    ) -> dict[str, Any]:
        """What becomes of a mutant, for the file of results; tiers done before are kept."""
        with self._reading:
            reaching = self._reach.tests(mutant)
        tiers: dict[str, dict[str, Any]] = dict(before["tiers"]) if before else {}
        killers = {fate["by"] for fate in tiers.values()} - {""}
        passed = set[str]()
        checkout = self.free.get()
        try:
            for tier, tests in members.items():
                every = [name for name in reaching if name in tests]
                own = self._affordable(every)
                by = next((name for name in own if name in killers), "")
                if tier not in tiers:
                    by = by or self._killer(
                        checkout, mutant, source, [name for name in own if name not in passed]
                    )
                    passed.update(() if by else own)
                    state = "killed" if by else "survived" if every else "unreached"
                    left_out = len(every) - len(own)
                    tiers[tier] = dict(state=state, by=by, tests=len(own), left_out=left_out)
                    killers |= {by} - {""}
        finally:
            self.free.put(checkout)
        kept = ("path", "scope", "line", "before", "after")
        return {**{key: getattr(mutant, key) for key in kept}, "tiers": tiers}

    def _affordable(self, tests: list[str]) -> list[str]:
        """Those that fit into the time for a mutant, by turns."""
        left, chosen = self._limit, list[str]()
        for name in tests:
            if self._reach.seconds[name] <= left:
                left -= self._reach.seconds[name]
                chosen.append(name)
        return chosen

    def _killer(self, checkout: Checkout, mutant: Mutant, source: bytes, tests: list[str]) -> str:
        """The first test that fails with the fault and passes without; empty if none does."""
        slower, endless = SLOWER, 0
        while tests:
            seconds = [self._reach.seconds[name] for name in tests]
            each, limit = GRACE + slower * max(seconds), START + slower * sum(seconds)
            checkout.mutate(mutant)
            try:
                arguments = [*self._arguments, f"--timeout={each:.0f}"]
                session = checkout.chosen(tests, arguments, limit, mutant.path)
            finally:
                checkout.restore(mutant, source)
            if session.code == PASSED:
                return ""
            if session.code == NONE_COLLECTED:
                raise RuntimeError("the recorded tests are no more; record anew")
            if session.code == TIMED_OUT and not session.failed:
                # Once may be the machine; twice, while the tests end without the fault, is not.
                endless += 1
                if endless > 1:
                    return TIME_OUT
                if checkout.chosen(tests, self._arguments, limit).code == TIMED_OUT:
                    slower, endless = 2.0 * slower, 0
            elif session.failed:
                if self._is_sound(checkout, session.failed):
                    return session.failed
                tests = [name for name in tests if name != session.failed]
            elif self._is_sound(checkout, tests[0]):
                return NO_TESTS
            else:
                raise RuntimeError(session.output[-2000:])
        return ""

    def _is_sound(self, checkout: Checkout, test: str) -> bool:
        """Whether a test passes in the copy without a fault."""
        if test not in self._sound:
            limit = START + SLOWER * self._reach.seconds[test]
            session = checkout.chosen([test], self._arguments, limit)
            self._sound[test] = session.code == PASSED
        return self._sound[test]
