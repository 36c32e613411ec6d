"""A one-axis board on a pseudo-terminal: the real firmware, and a hand at its handle.

As a program of its own it prints its port, and takes a JSON object on each line: `goal` [m] of the
hand, or `save`, the file for what its motor had.
"""

from __future__ import annotations

import contextlib
import json
import os
import select
import sys
import threading
import tty
from pathlib import Path

from cohaptic.clock import SystemClock
from cohaptic.runtime.scheduling import LOOP_PRIORITY, prefer_this_process
from tests.drivers.oneaxis.firmware import LIMIT, WATCHDOG, Rig

_CLOCK = SystemClock()


class Board:
    """A board with a handle.

    Attributes:
        rig: Firmware, motor, handle and hand.
        current: That its motor has [A].
        silent: Whether it hears and says nothing, as one that hangs; its motor goes on.
        instead: Sent in place of each answer; empty for the true one.
        given: Time (of its own clock) [s] and current [A], each time that it changed.
    """

    def __init__(self, limit: int = LIMIT, watchdog: int = WATCHDOG, *, swallow: int = 0) -> None:
        self.rig = Rig(limit, watchdog)
        self.current: float = 0.0
        self.silent = False
        self.instead = b""
        self.given: list[tuple[float, float]] = []
        self.answers = 0
        self._swallow = swallow
        self._board, self._host = os.openpty()
        tty.setraw(self._host)
        os.set_blocking(self._board, False)  # a board does not wait for a host that is gone
        self.path = os.ttyname(self._host)
        self._ends = threading.Event()
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    def unplug(self) -> None:
        """The port is gone, and the board's supply with it; may be called twice."""
        self._ends.set()
        self._thread.join()
        for end in (self._board, self._host):
            with contextlib.suppress(OSError):
                os.close(end)

    def _run(self) -> None:
        last = time = _CLOCK.now()
        while not self._ends.is_set():
            ready = select.select([self._board], [], [], 0.0005)[0]
            now = _CLOCK.now()
            # A thread that stood still is no hand that did, and no board whose host was silent: all
            # take small steps only.
            passed = min(now - last, 0.01)
            time += passed
            if ready and not self.silent:
                self._hear(os.read(self._board, 256), time)
            current: float = self.rig.step(time, passed)
            if current != self.current:
                self.given.append((now, current))
            self.current, last = current, now

    def _hear(self, data: bytes, now: float) -> None:
        data, self._swallow = data[self._swallow :], max(0, self._swallow - len(data))
        answer = self.rig.receive(data, now)
        if answer:
            self.answers += 1
            with contextlib.suppress(BlockingIOError):
                os.write(self._board, self.instead or answer)


def main() -> None:
    prefer_this_process(LOOP_PRIORITY)  # a real board has a processor of its own
    board = Board()
    sys.stdout.write(board.path + "\n")
    sys.stdout.flush()
    for line in sys.stdin:
        reported = json.loads(line)
        if "goal" in reported:
            board.rig.goal(reported["goal"])
        if "save" in reported:
            Path(reported["save"]).write_text(json.dumps(board.given))
            sys.stdout.write("saved\n")
            sys.stdout.flush()
    board.unplug()


if __name__ == "__main__":
    main()
