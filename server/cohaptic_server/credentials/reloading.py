"""Reloads files when they change, and when the process gets SIGHUP."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import os
import signal
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from cohaptic.errors import SettingError
from cohaptic.runtime.interrupt import on_hangup

log = logging.getLogger("cohaptic.server")

LOOK_EVERY = 2.0  # s; one check costs 10 us


@dataclass(frozen=True, slots=True)
class Watched:
    """Files that are reloaded together, such as a certificate and its key.

    Args:
        what: Description of the files for the log.
        paths: Paths of the files.
        load: Function that reads the files; raises SettingError and changes nothing if the files
            cannot be used.
    """

    what: str
    paths: Sequence[Path]
    load: Callable[[], None]


async def reload_changed(
    watched: Sequence[Watched], every: float = LOOK_EVERY, asked: asyncio.Event | None = None
) -> None:
    """Reload files when they change or SIGHUP arrives, until cancelled.

    If the terminal of this process has closed, SIGHUP ends the process, as SIGTERM does.

    Args:
        watched: Files that are loaded already.
        every: Time between two checks for changed files [s].
        asked: Event that requests a reload at once, as SIGHUP does; None for a private event.
    """
    asked = asyncio.Event() if asked is None else asked
    loop = asyncio.get_running_loop()
    hangup = getattr(signal, "SIGHUP", None)  # Windows has no SIGHUP
    if hangup is not None:
        with contextlib.suppress(ValueError, RuntimeError):  # only the main thread gets signals
            loop.add_signal_handler(hangup, on_hangup(asked.set))
    seen = [_marks(one) for one in watched]
    try:
        while True:
            with contextlib.suppress(TimeoutError):
                await asyncio.wait_for(asked.wait(), every if watched else None)
            at_once = asked.is_set()
            asked.clear()
            for i, one in enumerate(watched):
                marks = _marks(one)
                if marks == seen[i] and not at_once:
                    continue
                seen[i] = marks
                # A thread loads the files, since a disk may be slow and ticks must not wait.
                await asyncio.to_thread(_load, one)
    finally:
        if hangup is not None:
            with contextlib.suppress(ValueError, RuntimeError):
                loop.remove_signal_handler(hangup)


def _marks(one: Watched) -> list[tuple[int, int, int] | None]:
    marks: list[tuple[int, int, int] | None] = []
    for path in one.paths:
        try:
            about = os.stat(path)
            marks.append((about.st_mtime_ns, about.st_size, about.st_ino))
        except OSError:
            marks.append(None)
    return marks


def _load(one: Watched) -> None:
    try:
        one.load()
    except SettingError as error:
        log.warning("%s stays as it was: %s", one.what, error)
    else:
        log.info("%s was read again", one.what)
