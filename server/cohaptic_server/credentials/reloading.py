"""Files that are read again when they change, and when the process is asked to (SIGHUP)."""

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
from cohaptic.runtime.hangup import on_hangup

log = logging.getLogger("cohaptic.server")

LOOK_EVERY = 2.0  # s; to look costs 10 us


@dataclass(frozen=True, slots=True)
class Watched:
    """Some files that belong together.

    Args:
        what: They are, for people.
        paths: Paths of the files.
        load: Reads them; raises SettingError and changes nothing where they cannot be used.
    """

    what: str
    paths: Sequence[Path]
    load: Callable[[], None]


async def reload_changed(
    watched: Sequence[Watched], every: float = LOOK_EVERY, asked: asyncio.Event | None = None
) -> None:
    """Load files again when they change or SIGHUP comes, until cancelled.

    Where the terminal of this process has closed SIGHUP ends it, as SIGTERM does.

    Args:
        watched: What is loaded already.
        every: How often to look whether files have changed [s].
        asked: To be set by whoever wants them to be loaded at once, as SIGHUP does.
    """
    asked = asyncio.Event() if asked is None else asked
    loop = asyncio.get_running_loop()
    hangup = getattr(signal, "SIGHUP", None)  # Windows has none
    if hangup is not None:
        with contextlib.suppress(ValueError, RuntimeError):  # only a main thread hears signals
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
                # In a thread: a disk may take its time, and ticks do not wait for it.
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
