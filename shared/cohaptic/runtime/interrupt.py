"""Cancel a coroutine at SIGINT (Ctrl-C), SIGTERM or a terminal's close, on every system."""

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

    The loop waits with `select`: epoll rounds time-outs up to whole milliseconds, which would add
    to every delay. Use this function in processes with few sockets, such as clients. A terminal
    that closes (SIGHUP) interrupts `work`, too, unless the process ignores that signal (nohup).
    """
    with asyncio.Runner(loop_factory=DirectLoop) as runner:
        runner.run(until_interrupted(work, lifeline=lifeline, hangup=True))


async def until_interrupted(
    work: Coroutine[Any, Any, None], *, lifeline: bool = False, hangup: bool = False
) -> None:
    """Run `work` until it ends or is interrupted; an interrupted `work` finishes its clean-up.

    Only the first signal cancels `work`. A second one would cut short its clean-up, which fades
    out a force and removes shared memory, and which ends by itself within seconds.

    Args:
        lifeline: Whether to cancel also when standard input closes, so that a child process never
            outlives its parent, however the parent dies.
        hangup: Whether to cancel also when SIGHUP comes. False for a server, which may have to read
            its files again instead (`hangup.py`).
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
        # A read of sys.stdin.buffer would hold its lock, on which the process would abort at exit.
        while os.read(sys.stdin.fileno(), 4096):
            pass
        if not loop.is_closed():
            cancel()

    if lifeline:
        threading.Thread(target=watch, daemon=True).start()
    with _woken_by_signals(loop):
        for number in _interrupting(hangup=hangup):
            # loop.add_signal_handler is not used: after its removal, or once the loop has closed, a
            # signal would end the process at once. A signal masked here would go to another thread.
            signal.signal(number, cancel)
        try:
            await task
        except asyncio.CancelledError:
            pass
        finally:
            interrupted = True  # from here on no signal cuts the end of the process short


def _interrupting(*, hangup: bool) -> Generator[signal.Signals, None, None]:
    for name in ("SIGINT", "SIGTERM", *(["SIGHUP"] if hangup else [])):
        number = getattr(signal, name, None)  # Windows has no SIGHUP
        # Under `nohup` a program continues when its terminal closes.
        if number is not None and (name != "SIGHUP" or signal.getsignal(number) != signal.SIG_IGN):
            yield number


@contextlib.contextmanager
def _woken_by_signals(loop: asyncio.AbstractEventLoop) -> Generator[None, None, None]:
    """Make every signal wake the loop, in addition to calling its handler.

    Python calls handlers between two bytecodes. If a signal comes just before an idle loop waits
    for its next event, its handler would run only after that event, or never.
    """
    hears, signals = socket.socketpair()
    with hears, signals:
        hears.setblocking(False)
        signals.setblocking(False)
        try:
            loop.add_reader(hears, hears.recv, 64)
        except NotImplementedError:  # the proactor loop of Windows, which does the same by itself
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
    """Keep Ctrl-C from all processes started within the block, from their first instruction on.

    A Ctrl-C during the block reaches this process after the block. Windows has no mask of signals;
    there the block has no effect.
    """
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
