"""The firmware of the serial board on a pseudo-terminal, as far as the facts tell it."""

from __future__ import annotations

import contextlib
import os
import select
import threading
import tty

from cohaptic.vec import ZERO, Vec3

LARGEST = 6000  # mA; above it a motor gets none


class SerialBoard:
    """A board with an arm of a model.

    Attributes:
        counts: Of its encoders.
        currents: That its motors have [mA].
        silent: Whether it answers nothing.
        instead: Sent in place of each answer; empty for the true one.
        errors: Commands that it did not take.
    """

    def __init__(self, model: int = 3, *, swallow: int = 0) -> None:
        self.model = model
        self.counts: Vec3 = ZERO
        self.currents: Vec3 = ZERO
        self.silent = False
        self.instead = b""
        self.errors: list[int] = []
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
        self._ends.set()
        self._thread.join()
        for end in (self._board, self._host):
            with contextlib.suppress(OSError):
                os.close(end)

    def _run(self) -> None:
        waiting = b""
        while not self._ends.is_set():
            if not select.select([self._board], [], [], 0.01)[0]:
                continue
            waiting += os.read(self._board, 127 - min(126, len(waiting)))
            *lines, waiting = waiting.split(b"\n")
            for line in lines:
                self._take(line.strip(b"\0\r"))

    def _take(self, line: bytes) -> None:
        if self._swallow:
            self._swallow -= 1
            return
        error = self._obey(line)
        if error:
            self.errors.append(error)
        if self.silent:
            return
        a, b, c = (round(each) for each in self.counts)
        answer = f"[{self.model},{a},{b},{c},0,0,0,{error}]\n".encode()
        self.answers += 1
        with contextlib.suppress(BlockingIOError):
            os.write(self._board, self.instead or answer)

    def _obey(self, line: bytes) -> int:
        inside, end, rest = line.partition(b"]")
        if not end or not inside.startswith(b"["):
            return 256
        if rest:
            return 8
        parts = inside[1:].split(b",")
        if len(parts) != 3:
            return 512
        try:
            a, b, c = (int(part) for part in parts)
        except ValueError:
            return 1024
        self.currents = (
            float(a) if abs(a) <= LARGEST else 0.0,
            float(b) if abs(b) <= LARGEST else 0.0,
            float(c) if abs(c) <= LARGEST else 0.0,
        )
        return 0
