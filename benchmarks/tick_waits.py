"""Where the time of a server's missed ticks went."""

from __future__ import annotations

import os
import threading
from pathlib import Path

from cohaptic.clock import SystemClock
from cohaptic_server.shell.server import CohapticServer

CLOCK = SystemClock()


class Waits:
    """What the tick's thread did in the time of missed ticks, as the system has it.

    Args:
        server: Whose ticks they are.
    """

    def __init__(self, server: CohapticServer) -> None:
        self._server = server
        self._task = Path(f"/proc/self/task/{threading.get_native_id()}/schedstat")
        self._looks = [self._now()] * 2
        self._missed = 0
        self.clear()

    def clear(self) -> None:
        """Begin anew."""
        self.reported: list[dict[str, float]] = []

    def look(self) -> None:
        """Before each tick: note where the time went, if one was missed since the last look."""
        now, missed = self._now(), self._server.meters.missed
        before, last = self._looks
        if missed > self._missed:
            # It began late or took long: it is in the time between the last look and that before.
            since = {key: round(1e3 * (now[key] - before[key]), 1) for key in now}
            self.reported.append({"missed": missed - self._missed} | since)
        self._looks, self._missed = [last, now], missed

    def _now(self) -> dict[str, float]:
        ran, ready, _ = map(int, self._task.read_text().split())
        stolen = int(Path("/proc/stat").read_text().split(maxsplit=9)[8])
        return {
            "passed": CLOCK.now(),
            "ran": 1e-9 * ran,
            "ready": 1e-9 * ready,  # to run, and had no processor
            "stolen": stolen / os.sysconf("SC_CLK_TCK"),  # from this machine by its host
        }
