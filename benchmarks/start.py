"""How soon commands start: their help, an error of usage, a server, and a hand at it.

    python benchmarks/start.py [--runs 5] [--only serve force] [--json FILE]

Each is run once before, which leaves bytecode, and then `--runs` times. `listening` is the server
of the balloon until it says so. `engaged` is `cohaptic touch` at such a server until there can be
a force, and `force` until its simulated hand, which comes down then, feels one. Both are seen in
lines of JSON, ten a second. Processor time tells a start from a busy machine; that of a touch is
without its loop's process.
"""

from __future__ import annotations

import contextlib
import json
import os
import statistics
import subprocess
import time
from collections.abc import Callable, Generator, Sequence
from functools import partial
from importlib.metadata import entry_points

import json_report
from object_start import COHAPTIC, processor_time

Taken = tuple[float, float]  # wall and processor time [s]


def main() -> None:
    """Time what was chosen, and print a table."""
    cases = all_cases()
    parser = json_report.parser(__doc__)
    parser.add_argument("--runs", type=int, default=5)
    parser.add_argument("--only", nargs="+", choices=cases, metavar="CASE", default=list(cases))
    options = parser.parse_args()
    # Without bytecode a start compiles every module that it imports.
    os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
    results: list[json_report.Result] = []
    print("| start | least | median | processor, least | median |\n|---|---|---|---|---|")
    for name in options.only:
        cases[name]()
        wall, used = zip(*(cases[name]() for _ in range(options.runs)), strict=True)
        results.append({"start": name, **summary("wall", wall), **summary("processor", used)})
        print("| " + " | ".join([name, *(f"{s:.2f} s" for s in both(wall) + both(used))]) + " |")
    json_report.write(options, results)


def all_cases() -> dict[str, Callable[[], Taken]]:
    """What can be timed, by name."""
    names = sorted(entry.name for entry in entry_points(group="cohaptic.commands"))
    return {
        "help": partial(ended, "--help"),
        **{f"{name} help": partial(ended, name, "--help") for name in names},
        "usage error": partial(ended, "serve", "--nonsense"),
        "listening": listening,
        "engaged": partial(touched, "engaged"),
        "force": partial(touched, "force"),
    }


def ended(*arguments: str) -> Taken:
    """A command from its first line to its end."""
    before, begin = os.times(), time.perf_counter()
    subprocess.run([*COHAPTIC, *arguments], capture_output=True, check=False)
    wall, after = time.perf_counter() - begin, os.times()
    return wall, sum(after[2:4]) - sum(before[2:4])  # of children that have ended


def listening() -> Taken:
    """A server from its first line until it says where it listens."""
    begin = time.perf_counter()
    with running("serve", "--port", "0", "--quiet") as server:
        read_line(server)
        return time.perf_counter() - begin, processor_time(server.pid)


def touched(what: str) -> Taken:
    """A hand from its client's first line until it is engaged, or feels a force."""
    with running("serve", "--port", "0", "--quiet") as server:
        url = read_line(server).split()[1]
        begin = time.perf_counter()
        with running("touch", url, "--json-lines") as client:
            while True:
                status = json.loads(read_line(client))
                if status["force"] > 0.0 or (what == "engaged" and status["state"] == "free"):
                    return time.perf_counter() - begin, processor_time(client.pid)


@contextlib.contextmanager
def running(*arguments: str) -> Generator[subprocess.Popen[str]]:
    """A command's process, ended afterwards."""
    with subprocess.Popen(
        [*COHAPTIC, *arguments], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
    ) as process:
        try:
            yield process
        finally:
            process.terminate()


def read_line(process: subprocess.Popen[str]) -> str:
    """The next line that a process prints."""
    assert process.stdout is not None
    line = process.stdout.readline()
    if not line:
        raise SystemExit("a command has ended before its time")
    return line


def both(values: Sequence[float]) -> tuple[float, float]:
    """Least and median."""
    return min(values), statistics.median(values)


def summary(name: str, values: Sequence[float]) -> dict[str, float]:
    """The same, named for the report."""
    least, median = both(values)
    return {f"{name}_least_s": least, f"{name}_median_s": median}


if __name__ == "__main__":
    main()
