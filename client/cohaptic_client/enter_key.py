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

_MOST = 4096  # bytes of one read; what they say does not matter, only that there is a line


def on_enter(call: Callable[[], object]) -> Callable[[], None]:
    """Call `call` in the running event loop for each line of standard input.

    Returns:
        Ends the listening; a thread that waits for a key ends with the process.
    """
    loop, stopped = get_running_loop(), threading.Event()
    try:
        source = sys.stdin.fileno()
    except (AttributeError, OSError, ValueError):  # closed, or none of a process
        return stopped.set

    if hasattr(signal, "SIGTTIN"):
        # A terminal stops a process of the background that reads; this one need not be told.
        signal.signal(signal.SIGTTIN, signal.SIG_IGN)

    def told() -> None:
        if not stopped.is_set():
            call()

    def listen() -> None:
        while not stopped.is_set():
            try:
                text = os.read(source, _MOST)
            except OSError:
                return
            if not text:  # its end: nobody can say anything any more
                return
            if b"\n" in text and not stopped.is_set():
                try:
                    loop.call_soon_threadsafe(told)
                except RuntimeError:  # the loop has ended meanwhile
                    return

    # A thread: not every event loop waits for a terminal, and none for a file.
    threading.Thread(target=listen, name="enter key", daemon=True).start()
    return stopped.set
