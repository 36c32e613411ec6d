"""Time and memory to serve an object from a file: prepared once, then started from the store.

    python benchmarks/object_start.py [FILE] [--fix RULE] [--edge 0.05] [--starts 3] [--json FILE]
        [--json FILE]

Preparing is `cohaptic body prepare` with an empty store, a folder that is gone afterwards. A start
is `cohaptic serve` from its first line to `listening`, and from there until a hand can touch: a
`cohaptic touch` that was started before, and tries twice a second, is engaged on patches. It comes
down 1 s later and more; its first force is listed too. `cold` starts find the entries of the store
dropped from the system's memory (Linux). Memory is the largest of each process; a factor's file
counts with the process that maps it. Processor time tells a start from a busy machine.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import socket
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import json_report

ORGAN = Path(__file__).parents[1] / "examples/organ.ply"
COHAPTIC = [sys.executable, "-m", "cohaptic"]
_ENOUGH = 3.0  # s after the first force for the process beside the tick to have all it maps


def main() -> None:
    """Prepare, start cold and warm, and print a table."""
    parser = json_report.parser(__doc__)
    parser.add_argument("file", type=Path, nargs="?", default=ORGAN)
    parser.add_argument("--fix", default="z < 15%")
    parser.add_argument("--edge", type=float, default=0.05)
    parser.add_argument("--starts", type=int, default=3)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        os.environ["COHAPTIC_CACHE"] = folder
        results = [prepared(options, Path(folder))]
        for kind in ["cold", *["warm"] * options.starts]:
            results.append(started(options, Path(folder), kind))
    json_report.write(options, results)


def prepared(options: argparse.Namespace, store: Path) -> json_report.Result:
    """Prepare the object; time and memory."""
    begin = time.perf_counter()
    process = subprocess.Popen([*COHAPTIC, "body", "prepare", *described(options)])
    peak = 0
    while process.poll() is None:
        peak = max(peak, memory(process.pid))
        time.sleep(0.02)
    if process.returncode:
        sys.exit(process.returncode)
    taken = time.perf_counter() - begin
    stored = max(entry.stat().st_size for entry in store.iterdir())
    print(
        f"prepared in {taken:.1f} s with {1e-6 * peak:.0f} MB, {peak / stored:.2f} times the"
        f" {1e-6 * stored:.0f} MB that are stored\n\n"
        "| start | listening | hand engaged after | first force after | processor time of the"
        " server | server | worker |\n|---|---|---|---|---|---|---|"
    )
    return {"start": "prepare", "all_s": taken, "peak_bytes": peak, "stored_bytes": stored}


def started(options: argparse.Namespace, store: Path, kind: str) -> json_report.Result:
    """One start, and the first touch."""
    if kind == "cold" and hasattr(os, "posix_fadvise"):
        for entry in store.iterdir():
            with entry.open("rb") as file:
                os.fsync(file.fileno())
                os.posix_fadvise(file.fileno(), 0, 0, os.POSIX_FADV_DONTNEED)
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = str(free.getsockname()[1])
    hand = subprocess.Popen(
        [*COHAPTIC, "touch", f"ws://127.0.0.1:{port}", "--wait", "60", "--json-lines"],
        stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True,
    )  # fmt: skip
    assert hand.stdout is not None
    hand.stdout.readline()  # its libraries are there: it tries to reach a server
    begin = time.perf_counter()
    server = subprocess.Popen(
        [*COHAPTIC, "serve", "--quiet", "--port", port, "--body", *described(options)],
        stdout=subprocess.PIPE, text=True,
    )  # fmt: skip
    assert server.stdout is not None
    server.stdout.readline()
    listening = time.perf_counter() - begin
    used = processor_time(server.pid)
    engaged = touched = float("nan")
    for line in hand.stdout:
        status, after = json.loads(line), time.perf_counter() - begin - listening
        if status["state"] in ("free", "touching") and not engaged > 0.0:
            engaged = after
        if status["force"] > 0.0:
            touched = after
            break
    time.sleep(_ENOUGH)
    sizes = [memory(pid) for pid in (server.pid, *children(server.pid))]
    for process in (hand, server):
        process.terminate()
        process.wait()
    worker = max(sizes[1:], default=0)
    print(
        f"| {kind} | {listening:.2f} s | {engaged:.2f} s | {touched:.2f} s | {used:.2f} s |"
        f" {1e-6 * sizes[0]:.0f} MB | {1e-6 * worker:.0f} MB |"
    )
    return {
        "start": kind,
        "listening_s": listening,
        "engaged_s": engaged,
        "first_force_s": touched,
        "processor_s": used,
        "server_bytes": sizes[0],
        "worker_bytes": worker,
    }


def described(options: argparse.Namespace) -> list[str]:
    """The object, for the command line."""
    return [str(options.file), "--fix", options.fix, "--edge", str(options.edge)]


def memory(pid: int) -> int:
    """Largest memory of a process so far [bytes]; 0 where the system does not say."""
    with contextlib.suppress(OSError):
        for line in Path(f"/proc/{pid}/status").read_text().splitlines():
            if line.startswith("VmHWM:"):
                return 1024 * int(line.split()[1])
    return 0


def processor_time(pid: int) -> float:
    """Processor time of a process so far [s]; not a number where the system does not say."""
    with contextlib.suppress(OSError):
        fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
    return float("nan")


def children(pid: int) -> list[int]:
    """Processes that a process has started; none where the system does not say."""
    with contextlib.suppress(OSError):
        return [int(one) for one in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]
    return []


if __name__ == "__main__":
    main()
