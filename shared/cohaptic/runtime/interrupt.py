"""SIGINT (Ctrl-C) and SIGTERM cancel a coroutine, on every system."""

from __future__ import annotations

import asyncio
import contextlib
import os
import signal
import sys
import threading
from collections.abc import Coroutine, Generator
from typing import Any

from cohaptic.runtime.direct_loop import DirectLoop


def run(work: Coroutine[Any, Any, None], *, lifeline: bool = False) -> None:
    """Run `work` until it ends or is interrupted, on a loop whose timers are precise.

    The loop waits with `select`: epoll's timeouts are whole milliseconds, rounded up, and every
    leg of every delay would pay for that. For processes with few sockets, such as clients.
    """
    with asyncio.Runner(loop_factory=DirectLoop) as runner:
        runner.run(until_interrupted(work, lifeline=lifeline))


async def until_interrupted(work: Coroutine[Any, Any, None], *, lifeline: bool = False) -> None:
    """Run `work` until it ends, or until something cancels it; its clean-up is awaited.

    It is cancelled once. A second Ctrl-C would cut the clean-up short, and with it the fade of a
    force and the removal of shared memory; all of it ends within a few seconds by itself.

    Args:
        work: To be run.
        lifeline: End as well when standard input closes, so that a child process never outlives
            its parent, however that one dies.
    """
    task = asyncio.ensure_future(work)
    loop = asyncio.get_running_loop()
    interrupted = False

    def cancel(*_: object) -> None:
        nonlocal interrupted
        if not interrupted:
            interrupted = True
            loop.call_soon_threadsafe(task.cancel)

    def watch() -> None:
        # Not sys.stdin.buffer: a process that ends by itself would abort on its lock at the exit.
        while os.read(sys.stdin.fileno(), 4096):
            pass
        if not loop.is_closed():
            cancel()

    for number in (signal.SIGINT, signal.SIGTERM):
        # Not loop.add_signal_handler, which Windows lacks.
        signal.signal(number, cancel)
    if lifeline:
        threading.Thread(target=watch, daemon=True).start()
    try:
        await task
    except asyncio.CancelledError:
        pass
    finally:
        interrupted = True  # what is left is the end of the process, which no signal cuts short


@contextlib.contextmanager
def uninterrupted() -> Generator[None, None, None]:
    """A process that is started within never hears of Ctrl-C, not even before its first line.

    This process hears of it afterwards. Windows has no such mask.
    """
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
