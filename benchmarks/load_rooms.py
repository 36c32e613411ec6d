"""Our server with many rooms, as `load.py` starts and measures it."""

from __future__ import annotations

import contextlib
import os
import re
import signal
import time
from pathlib import Path

import progress
from cohaptic_tools.demo.processes import DemoFailed, Process

START = 180.0  # s for a server to open all its rooms; far more than it takes on a quiet machine
LEASE = 3600  # s for which a room may sleep
SPARE = 3  # seats of a room for each of its users
_WAKING = 1.0  # s for rooms that slept to have told that they are there
_FREE = """[limits]
open = 2000
open_in_all = 4000
connections = "1000:4000"
joins = "1000:4000"
"""


class Rooms:
    """Our server with many rooms, on some cores.

    All are started once, since that takes longer than a measurement. Those that are not measured
    sleep: they are held up by SIGSTOP, and cost nothing.
    """

    def __init__(self, folder: Path, rooms: int, room_users: int, cores: set[int]) -> None:
        path, self._log = folder / "rooms.toml", folder / "server.log"
        # A seat is kept for a while for one whose word of farewell a busy room has not read.
        seats = min(64, SPARE * room_users)
        limits = _FREE.replace("[limits]", "[rooms.{0}.limits]")
        tables = "".join(
            f'[rooms.r{i}]\nbody = "balloon"\nmax_users = {seats}\n' + limits.format(f"r{i}")
            for i in range(rooms)
        )
        settings = f"port = 0\nlease = {LEASE}\nmax_users = {rooms * seats}\n"
        path.write_text(f"{settings}{_FREE}{tables}")
        before = os.sched_getaffinity(0)
        os.sched_setaffinity(0, cores)  # its processes inherit it
        try:
            self._process = Process("serve", "--config", str(path), log=self._log)
            progress.say(f"{rooms} rooms are starting")
            url = self._first_line().removeprefix("listening ")
        finally:
            os.sched_setaffinity(0, before)
        self.urls = [f"{url}/r/r{i}" for i in range(rooms)]
        opened = dict(re.findall(r"room r(\d+) is open, process (\d+)", self._log.read_text()))
        self.pids = [int(opened[str(i)]) for i in range(rooms)]
        self._awake = rooms

    def _first_line(self) -> str:
        until = time.monotonic() + START

        def tell(words: str) -> None:
            progress.say(words)
            if time.monotonic() > until:
                raise DemoFailed(f"a server did not start in {START:g} s: {words}")

        try:
            return self._process.first_line(tell)
        except BaseException:
            self._process.wait()
            raise

    def wake(self, rooms: int) -> list[str]:
        """Let so many run and all others sleep; returns the addresses of those that run."""
        for pid in self.pids[rooms:]:
            os.kill(pid, signal.SIGSTOP)
        for pid in self.pids[:rooms]:
            os.kill(pid, signal.SIGCONT)
        if rooms > self._awake:
            time.sleep(_WAKING)
        self._awake = rooms
        return self.urls[:rooms]

    def spent(self) -> tuple[float, float]:
        """Processor time of the rooms and of the front so far [s]."""
        return sum(map(processor_time, self.pids)), processor_time(self._process.pid)

    def end(self) -> None:
        """End it."""
        for pid in self.pids:
            with contextlib.suppress(ProcessLookupError):
                os.kill(pid, signal.SIGCONT)
        self._process.wait()


def processor_time(pid: int) -> float:
    """Processor time of a process so far [s]."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
