"""The Enter key of the terminal, by which a user acknowledges a fault.

A key, and not a movement of the hand: the hand that a fault has startled would acknowledge it by
drawing back. Enter, and not any key: a line comes whole from every terminal, without its modes
being changed for a process that may be killed. A program that runs a client writes a line.
"""

from __future__ import annotations

import os
import signal
import sys
import threading
from asyncio import get_running_loop
from collections.abc import Callable

AGAIN = 0.5  # s between two looks whether this process is in front again
_MOST = 4096  # bytes of one read; what they say does not matter, only that there is a line


class EnterKey:
    """Calls a function in the running event loop for each line of standard input.

    Args:
        call: To be called.
    """

    def __init__(self, call: Callable[[], object]) -> None:
        self._call, self._loop = call, get_running_loop()
        self._stopped, self._listening = threading.Event(), False
        try:
            self._source = sys.stdin.fileno()
        except (AttributeError, OSError, ValueError):  # closed, or none of a process
            return
        if hasattr(signal, "SIGTTIN"):
            # A terminal stops a process of the background that reads; this one need not be told.
            signal.signal(signal.SIGTTIN, signal.SIG_IGN)
        self._listening = True
        # A thread: not every event loop waits for a terminal, and none for a file.
        threading.Thread(target=self._listen, name="enter key", daemon=True).start()

    def listening(self) -> bool:
        """Whether anybody can be heard: not without a standard input, nor after its end."""
        return self._listening

    def stop(self) -> None:
        """End the listening; a thread that waits for a key ends with the process."""
        self._stopped.set()

    def _told(self) -> None:
        if not self._stopped.is_set():
            self._call()

    def _listen(self) -> None:
        while not self._stopped.is_set():
            text = self._read()
            if text is None:  # its end: nobody can say anything any more
                break
            if b"\n" in text:
                try:
                    self._loop.call_soon_threadsafe(self._told)
                except RuntimeError:  # the loop has ended meanwhile
                    break
        self._listening = False

    def _read(self) -> bytes | None:
        """What was said; None once nothing can be any more."""
        try:
            return os.read(self._source, _MOST) or None
        except OSError:
            # In the background a terminal lets nobody read; the process may be in front again.
            if not os.isatty(self._source):
                return None
            self._stopped.wait(AGAIN)
            return b""
