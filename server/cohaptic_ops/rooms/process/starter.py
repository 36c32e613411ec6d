"""The process that rooms are forked from, and a hold on those that it has forked.

It has imported all that rooms need, so that one is back in a moment. Rooms outlive it; whoever
killed it would be noticed by the next room only that has to be started, which would wait for all of
these imports. So it gets a successor at once.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import multiprocessing
import os
import select
import signal
from collections.abc import Callable, Sequence
from multiprocessing.process import BaseProcess
from typing import Any

from cohaptic.clock import Clock
from cohaptic_ops.rooms.restarts import Restarts

log = logging.getLogger("cohaptic.server")

LOOK_EVERY = 0.5  # s between two looks at whether it is there


def can_fork() -> bool:
    """Whether rooms are forked here; elsewhere each is started by itself."""
    return "forkserver" in multiprocessing.get_all_start_methods()


def room_processes(preload: Sequence[str]) -> Callable[..., BaseProcess]:
    """How rooms are started: forked, where that can be, from a process that has imported all.

    Args:
        preload: Modules that it imports, beside those that every room needs.
    """
    context: Any = multiprocessing.get_context("forkserver" if can_fork() else "spawn")
    if can_fork():
        context.set_forkserver_preload(
            ["__main__", *preload, "cohaptic_ops.rooms.process.preloaded"]
        )
    make: Callable[..., BaseProcess] = context.Process
    return make


async def keep_starter(clock: Clock) -> None:
    """Start the process that rooms are forked from whenever it is not there, until cancelled.

    Args:
        clock: By which one that ends again and again is started later each time.
    """
    if not can_fork():
        return
    from multiprocessing import forkserver

    restarts, pid, since = Restarts(), 0, clock.now()
    while True:
        with contextlib.suppress(OSError):  # a room that cannot be started says why
            await asyncio.to_thread(forkserver.ensure_running)
        before, pid = pid, _starter_pid()
        pause = LOOK_EVERY
        if before not in (0, pid):
            now = clock.now()
            restarts, since = restarts.ended(since, now), now
            pause += restarts.pause
            told = {"event": "starter_ended"}
            log.warning("the process that starts rooms has ended; it has a successor", extra=told)
        await asyncio.sleep(pause)


def _starter_pid() -> int:
    """Number of the process; 0 where it cannot be told."""
    from multiprocessing import forkserver

    return getattr(getattr(forkserver, "_forkserver", None), "_forkserver_pid", None) or 0


class Hold:
    """On a process that has been started, by which it can be ended whoever has forked it.

    `multiprocessing` hears of the end of a process from the one that has forked it, and takes all
    of them for ended with that one: it would kill none of them any more.

    Args:
        process: That has been started.
    """

    def __init__(self, process: BaseProcess) -> None:
        self._process, self._file = process, -1
        if hasattr(os, "pidfd_open") and process.pid is not None:
            with contextlib.suppress(OSError):  # it has ended already, or the system has no such
                self._file = os.pidfd_open(process.pid)

    def kill(self) -> None:
        """End it now."""
        with contextlib.suppress(OSError, ValueError):
            if self._file >= 0:
                signal.pidfd_send_signal(self._file, signal.SIGKILL)
            else:
                self._process.kill()

    def join(self) -> None:
        """Wait for its end, then let go of it; in a thread."""
        if self._file >= 0:
            ended = select.poll()
            ended.register(self._file, select.POLLIN)
            ended.poll()
            os.close(self._file)
            self._file = -1
        self._process.join()
