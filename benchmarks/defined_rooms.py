"""Rooms on demand: what those cost that are defined and not in use.

    python benchmarks/defined_rooms.py [--rooms 12 1000] [--seconds 10] [--json FILE]

For each number of rooms one server, of which nothing is open at first, and then twelve rooms, each
of which somebody has asked for: told are the memory of all its processes (what they have in common
is divided among them), their processors, and how long the first answer of a room took.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tempfile
import time
import urllib.request
from pathlib import Path
from statistics import median

import json_report

_OPEN = 12
_SETTLED = 3.0  # s


def processes(pid: int) -> list[int]:
    """A process and all that it has started."""
    found = subprocess.run(["pgrep", "-P", str(pid)], capture_output=True, text=True, check=False)
    return [pid, *(each for child in found.stdout.split() for each in processes(int(child)))]


def memory(pids: list[int]) -> float:
    """Memory with shared pages divided [MB]."""
    texts = [Path(f"/proc/{pid}/smaps_rollup").read_text() for pid in pids]
    return sum(int(re.findall(r"^Pss:\s+(\d+)", text, re.MULTILINE)[0]) for text in texts) / 1e3


def processor(pids: list[int]) -> float:
    """Processor time so far [s]."""
    texts = [Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split() for pid in pids]
    return sum(int(text[11]) + int(text[12]) for text in texts) / os.sysconf("SC_CLK_TCK")


def measured(pid: int, seconds: float) -> tuple[float, float]:
    """Memory [MB] and processors of a server over a time."""
    time.sleep(_SETTLED)
    pids = processes(pid)
    before = processor(pids)
    time.sleep(seconds)
    return memory(pids), (processor(pids) - before) / seconds


def main() -> None:
    """Entry point."""
    parser = json_report.parser(__doc__)
    parser.add_argument("--rooms", type=int, nargs="+", default=[12, 1000])
    parser.add_argument("--seconds", type=float, default=10.0)
    a = parser.parse_args()
    results = list[json_report.Result]()
    print(
        "| rooms | memory, none open | processors | memory, 12 open | processors | first answer |"
    )
    print("|---|---|---|---|---|---|")
    for rooms in a.rooms:
        with tempfile.TemporaryDirectory() as folder:
            config = Path(folder, "rooms.toml")
            table = '[rooms.r{}]\nbody = "balloon"\nstart = "on demand"\n'
            config.write_text("port = 0\n" + "".join(table.format(k) for k in range(rooms)))
            command = [sys.executable, "-m", "cohaptic", "serve", "--config", str(config)]
            with subprocess.Popen([*command, "--quiet"], stdout=subprocess.PIPE, text=True) as one:
                assert one.stdout is not None
                url = one.stdout.readline().split()[-1].replace("ws://", "http://")
                asleep = measured(one.pid, a.seconds)
                waits = list[float]()
                for k in range(min(rooms, _OPEN)):
                    begin = time.monotonic()
                    urllib.request.urlopen(f"{url}/r/r{k}/healthz").read()
                    waits.append(time.monotonic() - begin)
                awake = measured(one.pid, a.seconds)
                one.terminate()
        row = {
            "rooms": rooms, "memory_mb": asleep[0], "processors": asleep[1],
            "open_memory_mb": awake[0], "open_processors": awake[1], "first_s": median(waits),
        }  # fmt: skip
        results.append(row)
        print(
            f"| {rooms} | {asleep[0]:.0f} MB | {asleep[1]:.3f} | {awake[0]:.0f} MB |"
            f" {awake[1]:.3f} | {median(waits):.2f} s |",
            flush=True,
        )
    json_report.write(a, results)


if __name__ == "__main__":
    main()
