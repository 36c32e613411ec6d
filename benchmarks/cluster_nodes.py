"""Three nodes on one machine: network namespaces with addresses of their own, and rooms in them.

A room stands for one of the program's: it ticks 60 times a second and tells so in a datagram to
the hub between the nodes, which no engine carries. All silences are measured there.
"""

from __future__ import annotations

import contextlib
import itertools
import json
import os
import secrets
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

NODES = (1, 2, 3)
HUB, HEARD_AT = "10.204.77.254", 7799
HZ = 60.0
_PATIENCE = 120.0  # s for anything to happen at all
_PAUSED = 1.0  # s; a room that is later by so much was held up, and does not catch up


def address(node: int) -> str:
    """Return the address of a node."""
    return f"10.204.77.{node}"


def tick(room: str) -> None:
    """Tick for ever, and tell of each tick how late it was [s]."""
    out = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    due = time.monotonic()
    while True:
        due += 1.0 / HZ
        time.sleep(max(0.0, due - time.monotonic()))
        late = time.monotonic() - due
        reported = {"room": room, "pid": os.getpid(), "late": late}
        with contextlib.suppress(OSError):
            out.sendto(json.dumps(reported).encode(), (HUB, HEARD_AT))
        if late > _PAUSED:
            due = time.monotonic()


class Tick(NamedTuple):
    """One datagram of a room.

    Fields:
        at: Time at which it came [s].
        sender: Address of the room's node.
        pid: Number of the room's process.
        late: Lateness of the tick [s].
    """

    at: float
    sender: str
    pid: int
    late: float


@dataclass(frozen=True)
class Heard:
    """Datagrams of all rooms, by room."""

    rooms: dict[str, list[Tick]] = field(default_factory=dict[str, list[Tick]])

    def start(self) -> None:
        """Listen for ever, in a thread."""
        inbox = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        inbox.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 22)
        inbox.bind((HUB, HEARD_AT))
        threading.Thread(target=self._listen, args=(inbox,), daemon=True).start()

    def _listen(self, inbox: socket.socket) -> None:
        while True:
            data, (sender, _) = inbox.recvfrom(1024)
            reported = json.loads(data)
            one = Tick(time.monotonic(), sender, reported["pid"], reported["late"])
            self.rooms.setdefault(reported["room"], []).append(one)

    def of_node(self, node: int) -> list[str]:
        """Return the rooms that were last heard from a node."""
        return [
            name for name, ticks in list(self.rooms.items()) if ticks[-1].sender == address(node)
        ]

    def since(self, room: str, when: float) -> list[Tick]:
        """Return the ticks of a room since a time [s]."""
        return [one for one in list(self.rooms[room]) if one.at >= when]

    def silences(self, rooms: Sequence[str], when: float, lost: int = 0) -> dict[str, float | None]:
        """Wait until rooms have other processes; return for how long each was silent [s].

        Args:
            rooms: Rooms.
            when: Time at which their processes were lost [s].
            lost: Node that does not count; 0 for none.
        """
        old = {room: self.since(room, when - 1.0)[0].pid for room in rooms}

        def new(room: str) -> Tick | None:
            return next(
                (
                    one
                    for one in self.since(room, when)
                    if one.pid != old[room] and one.sender != address(lost)
                ),
                None,
            )

        until(lambda: all(new(room) is not None for room in rooms))
        first = {room: new(room) for room in rooms}
        return {room: one and round(one.at - when, 2) for room, one in first.items()}

    def overlaps(self, rooms: Sequence[str], when: float, back: float) -> dict[str, float]:
        """Return for how long the old processes of rooms ticked after they came back [s].

        Args:
            rooms: Rooms that have other processes by now.
            when: Time at which the old processes were lost [s].
            back: Time at which they came back [s].
        """
        found: dict[str, float] = {}
        for room in rooms:
            old = self.since(room, when - 1.0)[0].pid
            times = [one.at - back for one in self.since(room, back) if one.pid == old]
            found[room] = round(max(times, default=0.0), 2)
        return found

    def longest(self, rooms: Sequence[str], begin: float, end: float) -> dict[str, float]:
        """Return the longest silence of each room between two times [s]."""
        found: dict[str, float] = {}
        for room in rooms:
            times = [begin, *(one.at for one in self.since(room, begin) if one.at < end), end]
            found[room] = round(max(b - a for a, b in itertools.pairwise(times)), 2)
        return found


def until(true: Callable[[], bool]) -> None:
    """Wait until something is true, or patience ends."""
    begin = time.monotonic()
    while not true() and time.monotonic() - begin < _PATIENCE:
        time.sleep(0.02)


def quantiles(seconds: Sequence[float]) -> dict[str, float]:
    """Return the median, the 99 % quantile and the largest of times, in ms."""
    ordered = sorted(seconds)
    places = {"median": len(ordered) // 2, "p99": int(0.99 * (len(ordered) - 1)), "largest": -1}
    return {name: round(1e3 * ordered[place], 2) for name, place in places.items()}


@dataclass(frozen=True)
class Network:
    """The namespaces of the nodes; this process is in that of the hub.

    Args:
        tag: Part of all their names.
    """

    tag: str

    def name(self, node: int) -> str:
        """Return the name of a node's namespace."""
        return f"cohaptic-{self.tag}-{node}"

    def command(self, node: int, *command: str) -> list[str]:
        """Return a command that runs on a node."""
        return ["ip", "netns", "exec", self.name(node), *command]

    def pids(self, node: int) -> list[int]:
        """Return the numbers of all processes of a node."""
        listed = subprocess.check_output(["ip", "netns", "pids", self.name(node)], text=True)
        return [int(pid) for pid in listed.split()]

    def signal(self, node: int, number: signal.Signals) -> float:
        """Send a signal to all processes of a node; return the time [s]."""
        for pid in self.pids(node):
            with contextlib.suppress(ProcessLookupError):
                os.kill(pid, number)
        return time.monotonic()

    def cable(self, node: int, state: str) -> float:
        """Put the cable of a node in ("up") or out ("down"); return the time [s]."""
        subprocess.run(["ip", "link", "set", f"to{node}", state], check=True)
        return time.monotonic()

    def memory(self, node: int) -> float:
        """Return the memory of a node's processes, with shared pages divided [MB]."""
        total = 0
        for pid in self.pids(node):
            with contextlib.suppress(OSError):
                lines = Path(f"/proc/{pid}/smaps_rollup").read_text().splitlines()
                total += sum(int(line.split()[1]) for line in lines if line.startswith("Pss:"))
        return round(total / 1e3)

    def processor(self, node: int) -> float:
        """Return the processor time of a node's processes so far [s]."""
        ticks = 0
        for pid in self.pids(node):
            with contextlib.suppress(OSError):
                fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
                ticks += int(fields[11]) + int(fields[12])
        return ticks / os.sysconf("SC_CLK_TCK")

    def in_use(self, seconds: float) -> list[float]:
        """Return how many processors each node uses, over a time [s]."""
        before = [self.processor(node) for node in NODES]
        time.sleep(seconds)
        after = [self.processor(node) for node in NODES]
        return [round((b - a) / seconds, 3) for a, b in zip(before, after, strict=True)]


@contextlib.contextmanager
def network() -> Generator[Network]:
    """Make the nodes and their cables to a bridge; end all processes on them afterwards.

    The program begins anew within a namespace of its own for the hub.
    """
    tag = os.environ.get("COHAPTIC_HUB", "")
    if not tag:
        tag = secrets.token_hex(2)
        hub = f"cohaptic-{tag}-hub"
        subprocess.run(["ip", "netns", "add", hub], check=True)
        command = ["ip", "netns", "exec", hub, sys.executable, *sys.argv]
        try:
            sys.exit(subprocess.call(command, env=os.environ | {"COHAPTIC_HUB": tag}))
        finally:
            subprocess.run(["ip", "netns", "del", hub], check=False)
    made, found = list[int](), Network(tag)
    try:
        _ip("link", "add", "hub", "type", "bridge")
        _ip("addr", "add", f"{HUB}/24", "dev", "hub")
        _ip("link", "set", "lo", "up")
        _ip("link", "set", "hub", "up")
        for node in NODES:
            name = found.name(node)
            _ip("netns", "add", name)
            made.append(node)
            peer = ("peer", "name", "cable", "netns", name)
            _ip("link", "add", f"to{node}", "type", "veth", *peer)
            _ip("link", "set", f"to{node}", "master", "hub", "up")
            _ip("-n", name, "addr", "add", f"{address(node)}/24", "dev", "cable")
            _ip("-n", name, "link", "set", "lo", "up")
            _ip("-n", name, "link", "set", "cable", "up")
        yield found
    finally:
        for node in made:
            found.signal(node, signal.SIGKILL)
            subprocess.run(["ip", "netns", "del", found.name(node)], check=False)


def _ip(*arguments: str) -> None:
    subprocess.run(["ip", *arguments], check=True)
