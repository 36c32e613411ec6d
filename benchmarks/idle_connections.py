"""Thousands of connections that never shake hands, and a user who touches meanwhile.

    python benchmarks/idle_connections.py [--connections 10000] [--addresses 50] [--seconds 8]
        [--limits raised|usual] [--json FILE]

The connections come from many addresses of loopback (127.0.1.x), so that the budgets of one do not
hide them, and each that the server cuts is opened again. With `usual` the server has its own
budgets, and refuses most; with `raised` it has to hold all. One user presses and reads its patches
before and meanwhile, at 60 Hz: of its patches the lateness and the ticks left out are told for both
times. Memory is the server's, resident, and the kernel's: both ends of a connection are on this
machine, so that of the kernel is halved. It needs a hard limit of open files above the connections.
"""

from __future__ import annotations

import contextlib
import resource
import select
import socket
import sys
import tempfile
import time
from multiprocessing.connection import Connection as Pipe
from pathlib import Path

import numpy as np

import json_report
from cohaptic_tools.demo.processes import Process as Serving
from core_users import PERIOD, User
from load_users import RoomCount
from tick_lateness import lateness
from users_per_core import Process

_AT_ONCE = 400  # connections that are begun in one round
_OPENING = 20.0  # s at most for the connections to be opened; all of it counts
_PAGE = resource.getpagesize()
RAISED = ("open=100000", "open_in_all=100000", "connections=1000000:1000000")


def attack(port: int, many: int, addresses: int, pipe: Pipe) -> None:
    """Main function of a process: hold so many connections until the pipe says `False`.

    `True` is answered by how many it holds, and how many it has begun and lost so far.
    """
    _raise_files(many)
    held: dict[int, socket.socket] = {}
    poll = select.epoll()
    poll.register(pipe.fileno(), select.EPOLLIN)
    begun = lost = 0
    while True:
        for _ in range(min(_AT_ONCE, many - len(held))):
            connection = socket.socket()
            connection.setblocking(False)
            begun += 1
            with contextlib.suppress(BlockingIOError):
                connection.bind((f"127.0.1.{1 + begun % addresses}", 0))
                connection.connect(("127.0.0.1", port))
            held[connection.fileno()] = connection
            poll.register(connection.fileno(), select.EPOLLIN | select.EPOLLRDHUP)
        for file, _ in poll.poll(0.005):
            if file == pipe.fileno():
                if not pipe.recv():
                    return
                pipe.send((len(held), begun, lost))
            else:  # it was told something, and is closed
                poll.unregister(file)
                held.pop(file).close()
                lost += 1


def press(url: str, pipe: Pipe) -> None:
    """Main function of a process: a user, who answers with the times of its ticks so far."""
    count, user, sent = RoomCount(), User(url, "plane", "press", 0.0, 0.0, 0), 0
    start = time.perf_counter()
    while True:
        files: list[socket.socket | Pipe] = [user.socket, pipe]
        ready, _, _ = select.select(
            files, [], [], max(0.0, start + sent * PERIOD - time.perf_counter())
        )
        if user.socket in ready:
            user.read(count)
        if pipe in ready:
            if not pipe.recv():
                user.leave()
                return
            pipe.send(count.ticks)
            count.ticks = []
        while start + sent * PERIOD <= time.perf_counter():
            user.write(time.perf_counter() - start)
            sent += 1


def kernel_memory() -> float:
    """Kernel memory of sockets and slabs [bytes]."""
    fields = dict(line.split(":", 1) for line in Path("/proc/meminfo").read_text().splitlines())
    slab = 1024.0 * int(fields["Slab"].split()[0])
    words = Path("/proc/net/sockstat").read_text().split("TCP:")[1].split()
    return slab + _PAGE * int(words[words.index("mem") + 1])


def resident(pid: int) -> float:
    """Memory of a process [bytes]."""
    return _PAGE * float(Path(f"/proc/{pid}/statm").read_text().split()[1])


def _raise_files(many: int) -> None:
    hard = resource.getrlimit(resource.RLIMIT_NOFILE)[1]
    wanted = many + 500
    if hard not in (-1, resource.RLIM_INFINITY) and hard < wanted:
        sys.exit(
            f"the hard limit of open files is {hard}; it must be at least {wanted}: ulimit -Hn"
        )
    resource.setrlimit(resource.RLIMIT_NOFILE, (wanted, hard))


def _report(ticks: list[float]) -> tuple[float, int]:
    """Lateness at the 99th percentile [s], and ticks that were left out."""
    late = lateness(ticks)
    return float(np.quantile(late, 0.99)), int((late >= PERIOD).sum())


def measure(many: int, addresses: int, seconds: float, limits: str) -> json_report.Result:
    """One comparison.

    Args:
        many: Connections.
        addresses: From which they come.
        seconds: Length of each of both times.
        limits: `raised` or `usual`.
    """
    _raise_files(many)
    options = [word for one in RAISED if limits == "raised" for word in ("--largest", one)]
    with tempfile.TemporaryDirectory() as name:
        log = Path(name) / "log"
        server = Serving("serve", "--port", "0", *options, log=log)
        url = server.first_line().removeprefix("listening ")
        victim = Process(press, url)
        hostile = None
        try:
            time.sleep(2.0)
            victim.ask()
            kernel, memory = kernel_memory(), resident(server.pid)
            time.sleep(seconds)
            before = _report(victim.ask())
            begins = time.monotonic() + _OPENING
            hostile = Process(attack, int(url.rpartition(":")[2]), many, addresses)
            largest = 0
            victim.ask()
            while time.monotonic() < begins and largest < 0.9 * many:
                largest = hostile.ask()[0]
                time.sleep(0.1)
            until = time.monotonic() + seconds
            kernel_limit, memory_limit = kernel, memory
            while time.monotonic() < until:
                held = hostile.ask()[0]
                largest = max(largest, held)
                kernel_limit = max(kernel_limit, kernel_memory())
                memory_limit = max(memory_limit, resident(server.pid))
                time.sleep(0.1)
            meanwhile = _report(victim.ask())
            _, begun, lost = hostile.ask()
        finally:
            for process in (hostile, victim):
                if process is not None:
                    process.pipe.send(False)
                    process.end()
            server.wait()
        lines = len(log.read_text().splitlines())
    return {
        "limits": limits, "connections": many, "most_held": largest, "begun": begun, "lost": lost,
        "late_p99_before_s": before[0], "late_p99_s": meanwhile[0],
        "left_out_before": before[1], "left_out": meanwhile[1],
        "server_bytes_each": (memory_limit - memory) / max(1, largest),
        "kernel_bytes_each": 0.5 * (kernel_limit - kernel) / max(1, largest),
        "log_lines": lines,
    }  # fmt: skip


def main() -> None:
    """Print what came of it."""
    parser = json_report.parser(__doc__)
    parser.add_argument("--connections", type=int, default=10_000)
    parser.add_argument("--addresses", type=int, default=50)
    parser.add_argument("--seconds", type=float, default=8.0)
    parser.add_argument("--limits", choices=["raised", "usual"], default="raised")
    options = parser.parse_args()
    row = measure(options.connections, options.addresses, options.seconds, options.limits)
    for name, value in row.items():
        print(name, f"{value:.4g}" if isinstance(value, float) else value, flush=True)
    json_report.write(options, [row])


if __name__ == "__main__":
    main()
