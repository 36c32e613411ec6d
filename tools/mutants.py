"""How many random faults do the tests see? Makes mutants of the core, and runs the tests on them.

    python tools/mutants.py record --db reach.db --select 'tests -n 2 -m "not (live or alone)"'
    python tools/mutants.py run --db reach.db --sample 120 --json before.json
    python tools/mutants.py show before.json [after.json]

mutmut 3 was not taken: it changes bodies of functions only, passes over decorated ones, knows tests
by function and draws no sample by a seed. Neither was cosmic-ray: it runs one command for each
mutant, whatever its line, and changes the sources in place.

Everything runs in copies of the checkout, as plain Python, on the same examples of
hypothesis. A mutant is killed if one of the tests that reach its statement fails, or does not end,
that passes without the fault; `mutant_reach.py` says what is known of who reaches what. Tests that
failed while they were recorded, under coverage and in a copy without .git and what is built, count
for nothing.
"""

from __future__ import annotations

import argparse
import json
import shlex
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from mutant_checkout import Checkout, known_files
from mutant_making import sample
from mutant_reach import Reach, record
from mutant_running import run

ROOT = Path(__file__).parents[1]
PACKAGES = {
    "control": ("shared/cohaptic/control/",),
    "protocol": ("shared/cohaptic/protocol/",),
    "world": ("server/cohaptic_server/world/",),
    "room": ("server/cohaptic_server/room/",),
    "access": ("server/cohaptic_server/access/", "server/cohaptic_server/credentials/"),
    "cholesky": ("server/cohaptic_server/cholesky/",),
    "loop": ("client/cohaptic_client/loop/",),
}
Results = dict[str, dict[str, Any]]  # by the mutant's name; see `mutant_running.run`


def package_of(path: str) -> str:
    """Name of the package of a source; empty for one that is not mutated."""
    if not path.endswith(".py"):
        return ""
    return next((name for name, folders in PACKAGES.items() if path.startswith(folders)), "")


def main() -> None:
    """Do what the command line says."""
    options = parsed()
    if options.command == "show":
        results = [json.loads(path.read_text(encoding="utf-8")) for path in options.files]
        print("\n".join(summary(results[-1])))
        if len(results) > 1:
            print("\n".join(comparison(results[0], results[-1])))
    elif options.command == "record":
        with tempfile.TemporaryDirectory() as folder:
            checkout = Checkout(ROOT, Path(folder))
            session = record(checkout, Path(folder), shlex.split(options.select), options.db)
        bad = [name for name, (_, how) in session.tests.items() if how == "failed"]
        print(session.output[-2000:])
        print(f"{len(session.tests)} tests recorded; these failed and count for nothing: {bad}")
    else:
        names = [name for name in known_files(ROOT) if package_of(name) in options.packages]
        sources = {name: (ROOT / name).read_bytes() for name in names}
        tiers = dict(tier.split("=", 1) for tier in options.tier)
        run(
            sample(sources, options.sample, options.seed),
            sources,
            Reach(options.db, ROOT),
            tiers or {options.mark or "all": options.mark},
            shlex.split(options.pytest),
            options.limit,
            options.json,
            options.jobs,
            ROOT,
        )
        print("\n".join(summary(json.loads(options.json.read_text(encoding="utf-8")))))


def parsed() -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(description="How many random faults do the tests see?")
    commands = parser.add_subparsers(dest="command", required=True)
    recorded = commands.add_parser("record", help="which tests reach which line, once")
    recorded.add_argument("--db", type=Path, required=True, help="made, or added to")
    recorded.add_argument("--select", default="tests", help="arguments of pytest")
    ran = commands.add_parser("run", help="run the tests on mutants")
    add = ran.add_argument
    add("--db", type=Path, required=True)
    add("--sample", type=int, default=120, help="number of mutants")
    add("--seed", type=int, default=0)
    add("--packages", nargs="*", choices=PACKAGES, default=list(PACKAGES))
    kills = "count kills of the tests that `pytest -m MARKS` chooses; several times"
    add("--tier", action="append", default=[], metavar="NAME=MARKS", help=kills)
    add("--mark", default="", help="the same for a single tier: an expression for -m")
    add("--pytest", default="", help="more arguments of pytest, such as -m night")
    times = "for a mutant's tests, by their recorded times; others are left out"
    add("--most", type=float, default=float("inf"), metavar="SECONDS", help=times)
    add("--json", type=Path, required=True, help="made, or completed")
    add("--jobs", type=int, default=1, help="mutants at a time")
    shown = commands.add_parser("show", help="kills and survivors; what changed between two files")
    shown.add_argument("files", type=Path, nargs="+")
    return parser.parse_args()


def summary(results: Results) -> Iterator[str]:
    """Kills of each package and tier, then the survivors, one a line."""
    tiers = list(dict.fromkeys(tier for found in results.values() for tier in found["tiers"]))
    for tier in tiers:
        yield f"tier {tier}: killed, of mutants"
        for package in [*PACKAGES, "all"]:
            states = [
                found["tiers"][tier]["state"]
                for found in results.values()
                if tier in found["tiers"] and package in ("all", package_of(found["path"]))
            ]
            if states:
                unreached = states.count("unreached")
                rest = f", {unreached} of the others reached by no test" if unreached else ""
                yield f"  {package:<10}{states.count('killed'):>4} of {len(states)}{rest}"
    for tier in tiers:
        yield f"survivors of {tier}:"
        for found in sorted(results.values(), key=lambda f: (f["path"], f["line"])):
            state = found["tiers"].get(tier, {"state": "killed"})["state"]
            if state != "killed":
                left_out = found["tiers"][tier]["left_out"]
                rest = f" ({left_out} tests left out)" if left_out else ""
                yield f"  {place(found)}{' (unreached)' if state == 'unreached' else rest}"


def comparison(before: Results, now: Results) -> Iterator[str]:
    """The mutants that both have: kills of each tier, and each mutant whose fate changed."""
    both = [name for name in now if name in before]
    yield f"{len(both)} mutants are in both"
    for tier in dict.fromkeys(tier for name in both for tier in now[name]["tiers"]):
        shared = [
            name for name in both if tier in before[name]["tiers"] and tier in now[name]["tiers"]
        ]
        was = {name for name in shared if before[name]["tiers"][tier]["state"] == "killed"}
        are = {name for name in shared if now[name]["tiers"][tier]["state"] == "killed"}
        yield f"tier {tier}: killed before {len(was)}, killed now {len(are)}, of {len(shared)}"
        yield from (f"  newly killed: {place(now[name])}" for name in sorted(are - was))
        yield from (f"  killed no more: {place(now[name])}" for name in sorted(was - are))


def place(found: dict[str, Any]) -> str:
    """A mutant for people: where, and what became what, each on one line."""
    before, after = (" ".join(found[key].split()) or "nothing" for key in ("before", "after"))
    return f"{found['path']}:{found['line']}: {before} -> {after}"


if __name__ == "__main__":
    main()
