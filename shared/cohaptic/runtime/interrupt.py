"""Handle signals to a command in the same way on every system, however the command was started.

SIGINT (Ctrl-C), SIGTERM or a closing terminal cancels a coroutine, which finishes its clean-up.

In a server SIGHUP has two meanings: its terminal closed, or an administrator wants files read
again. If a standard stream is a terminal that has closed, SIGHUP ends the server as SIGTERM does,
because nobody could see the server or end it by Ctrl-C any more.
"""

from __future__ import annotations

import asyncio
import contextlib
import os
import select
import signal
import socket
import stat
import sys
import threading
from collections.abc import Callable, Coroutine, Generator
from typing import Any

from cohaptic.runtime.direct_loop import DirectLoop


def run(work: Coroutine[Any, Any, None], *, lifeline: bool = False) -> None:
    """Run `work` on a new `DirectLoop` until it ends or a signal interrupts it.

    The loop waits with `select`: epoll rounds time-outs up to whole milliseconds, which would add
    to every delay. Use this function in processes with few sockets, such as clients. A terminal
    that closes (SIGHUP) interrupts `work`, too, unless the process ignores that signal (nohup).

    Args:
        lifeline: As for `until_interrupted`.
    """
    with asyncio.Runner(loop_factory=DirectLoop) as runner:
        runner.run(until_interrupted(work, lifeline=lifeline, hangup=True))


async def until_interrupted(
    work: Coroutine[Any, Any, None], *, lifeline: bool = False, hangup: bool = False
) -> None:
    """Run `work` until it ends, or until a signal cancels it and its clean-up has finished.

    Only the first signal cancels `work`. A second one would interrupt the clean-up, which fades out
    a force and removes shared memory, and which ends by itself within seconds.

    Args:
        lifeline: Whether to cancel also when standard input closes, so that a child process never
            outlives its parent, however the parent dies.
        hangup: Whether to cancel also when SIGHUP comes. False for a server, which may have to read
            its files again instead (`on_hangup`).
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
            interrupted = True  # from here on no signal interrupts the end of the process


def _interrupting(*, hangup: bool) -> Generator[signal.Signals, None, None]:
    for name in ("SIGINT", "SIGTERM", *(["SIGHUP"] if hangup else [])):
        number = getattr(signal, name, None)  # Windows has no SIGHUP
        # Under `nohup` a program continues when its terminal closes.
        if number is not None and (name != "SIGHUP" or signal.getsignal(number) != signal.SIG_IGN):
            yield number


@contextlib.contextmanager
def _woken_by_signals(loop: asyncio.AbstractEventLoop) -> Generator[None, None, None]:
    """Within the block, make every signal wake the loop, besides calling its handler.

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
    """Block SIGINT (Ctrl-C) in all processes that the block starts, from their first instruction.

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


def terminal_has_gone() -> bool:
    """Return whether a standard stream of this process is a terminal that has closed."""
    if not hasattr(select, "poll"):
        return False
    streams = select.poll()
    for file in range(3):
        with contextlib.suppress(OSError):  # the stream is closed
            if stat.S_ISCHR(os.fstat(file).st_mode):
                streams.register(file, 0)  # poll reports a hang-up in any case
    return any(event & select.POLLHUP for _, event in streams.poll(0))


def on_hangup(again: Callable[[], None]) -> Callable[[], None]:
    """Return a handler of SIGHUP, which ends the process as SIGTERM does or reads files again.

    The handler ends the process if the terminal has closed, but never if this function was called
    while the process ignored SIGHUP, as under `nohup`.

    Args:
        again: Function that reads the files again.
    """
    hangup = getattr(signal, "SIGHUP", None)  # Windows has none
    stays = hangup is not None and signal.getsignal(hangup) is signal.SIG_IGN

    def heard() -> None:
        if not stays and terminal_has_gone():
            signal.raise_signal(signal.SIGTERM)
        else:
            again()

    return heard
