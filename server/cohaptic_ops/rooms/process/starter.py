"""Runs the starter, the process from which rooms are forked, and makes handles of the rooms.

The starter has imported all modules that rooms need, so that a room starts at once. Rooms go on if
the starter ends, but the next room to be started would have to wait for all these imports. This
module therefore starts a new starter as soon as the old one has ended.
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
from cohaptic_ops.restarts import Restarts

log = logging.getLogger("cohaptic.server")

LOOK_EVERY = 0.5  # s between two checks that the starter runs


def can_fork() -> bool:
    """Whether this system can fork rooms; otherwise each room is spawned."""
    return "forkserver" in multiprocessing.get_all_start_methods()


def room_processes(preload: Sequence[str]) -> Callable[..., BaseProcess]:
    """Return the class of room processes: forked from the starter if the system can fork.

    Args:
        preload: Modules that the starter imports, beside the modules that every room needs.
    """
    context: Any = multiprocessing.get_context("forkserver" if can_fork() else "spawn")
    if can_fork():
        context.set_forkserver_preload(
            ["__main__", *preload, "cohaptic_ops.rooms.process.preloaded"]
        )
    make: Callable[..., BaseProcess] = context.Process
    return make


async def keep_starter(clock: Clock) -> None:
    """Keep the starter running until cancelled: start it again whenever it has ended.

    Args:
        clock: Clock for the back-off if the starter ends again and again.
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
            reported = {"event": "starter_ended"}
            log.warning(
                "the process that starts rooms has ended; it has a successor", extra=reported
            )
        await asyncio.sleep(pause)


def _starter_pid() -> int:
    """Return the process id of the starter; 0 if it is not known."""
    from multiprocessing import forkserver

    return getattr(getattr(forkserver, "_forkserver", None), "_forkserver_pid", None) or 0


class Hold:
    """Handle that can kill a room's process even if the starter that forked it has ended.

    `multiprocessing` learns of the end of a process from the starter that forked it. If the starter
    has ended, `multiprocessing` believes that its processes have ended, too, and kills none.
    """

    def __init__(self, process: BaseProcess) -> None:
        self._process, self._file = process, -1
        if hasattr(os, "pidfd_open") and process.pid is not None:
            with contextlib.suppress(OSError):  # the process has ended, or the system lacks pidfds
                self._file = os.pidfd_open(process.pid)

    def kill(self) -> None:
        """Kill the process now."""
        with contextlib.suppress(OSError, ValueError):
            if self._file >= 0:
                signal.pidfd_send_signal(self._file, signal.SIGKILL)
            else:
                self._process.kill()

    def join(self) -> None:
        """Wait for the end of the process, and close the handle; blocks the calling thread."""
        if self._file >= 0:
            ended = select.poll()
            ended.register(self._file, select.POLLIN)
            ended.poll()
            os.close(self._file)
            self._file = -1
        self._process.join()
