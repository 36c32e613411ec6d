"""SIGINT (Ctrl-C), SIGTERM and the end of a terminal cancel a coroutine, on every system."""

from __future__ import annotations

import asyncio
import contextlib
import os
import signal
import socket
import sys
import threading
from collections.abc import Coroutine, Generator
from typing import Any

from cohaptic.runtime.direct_loop import DirectLoop


def run(work: Coroutine[Any, Any, None], *, lifeline: bool = False) -> None:
    """Run `work` until it ends or is interrupted, on a loop whose timers are precise.

    The loop waits with `select`: epoll's timeouts are whole milliseconds, rounded up, and every
    leg of every delay would pay for that. For processes with few sockets, such as clients. A
    terminal that closes (SIGHUP) interrupts them, too, unless they ignore that (nohup).
    """
    with asyncio.Runner(loop_factory=DirectLoop) as runner:
        runner.run(until_interrupted(work, lifeline=lifeline, hangup=True))


async def until_interrupted(
    work: Coroutine[Any, Any, None], *, lifeline: bool = False, hangup: bool = False
) -> None:
    """Run `work` until it ends, or until something cancels it; its clean-up is awaited.

    It is cancelled once. A second Ctrl-C would cut the clean-up short, and with it the fade of a
    force and the removal of shared memory; all of it ends within a few seconds by itself.

    Args:
        work: To be run.
        lifeline: End as well when standard input closes, so that a child process never outlives
            its parent, however that one dies.
        hangup: End as well when SIGHUP comes; a server may have to read its files again then
            (`hangup.py`).
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

    if lifeline:
        threading.Thread(target=watch, daemon=True).start()
    with _woken_by_signals(loop):
        for number in _interrupting(hangup=hangup):
            # Not loop.add_signal_handler: without it, or with the loop, a signal would end the
            # process at once, and a mask of this thread leaves it to another.
            signal.signal(number, cancel)
        try:
            await task
        except asyncio.CancelledError:
            pass
        finally:
            interrupted = True  # what is left is the end of the process, which no signal cuts short


def _interrupting(*, hangup: bool) -> Generator[signal.Signals, None, None]:
    for name in ("SIGINT", "SIGTERM", *(["SIGHUP"] if hangup else [])):
        number = getattr(signal, name, None)  # Windows has no SIGHUP
        # Under `nohup` a program goes on when its terminal closes.
        if number is not None and (name != "SIGHUP" or signal.getsignal(number) != signal.SIG_IGN):
            yield number


@contextlib.contextmanager
def _woken_by_signals(loop: asyncio.AbstractEventLoop) -> Generator[None, None, None]:
    """Every signal is an event of the loop, beside what its handler does.

    Handlers are called between two lines of Python: of a signal that comes just before the loop
    waits for its next event, an idle loop would hear when that comes, or never.
    """
    hears, signals = socket.socketpair()
    with hears, signals:
        hears.setblocking(False)
        signals.setblocking(False)
        try:
            loop.add_reader(hears, hears.recv, 64)
        except NotImplementedError:  # the other loop of Windows, which does the same by itself
            yield
            return
        before = signal.set_wakeup_fd(signals.fileno(), warn_on_full_buffer=False)
        try:
            yield
        finally:
            signal.set_wakeup_fd(before)
            loop.remove_reader(hears)


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
