"""Runs `cohaptic touch`: runs a client to its end, and shows the client's state meanwhile.

The user acknowledges a fault with the Enter key of the terminal. A movement of the hand does not
count as acknowledgement: a hand that a fault has startled draws back, and would acknowledge the
fault by that. Enter is the key, because every terminal delivers whole lines without a change of its
modes, which a killed process could not undo. A program that runs a client writes a line to the
client's standard input.
"""

from __future__ import annotations

import asyncio
import contextlib
import math
import os
import signal
import sys
import threading
from asyncio import get_running_loop
from collections.abc import Callable
from typing import IO, TYPE_CHECKING, TextIO, cast

from rich.console import Console

from cohaptic.cli.output import Output
from cohaptic.errors import CohapticError, OutputError
from cohaptic.recording.recorder import Recorder
from cohaptic.runtime.aside import Aside, aside
from cohaptic.status.row import last_row
from cohaptic.status.table import EVERY, Summary, status_line
from cohaptic.vec import ZERO
from cohaptic_client.client import Client
from cohaptic_client.loop.added import reasons_of
from cohaptic_client.settings import ClientSettings

if TYPE_CHECKING:
    from cohaptic_client.own_session import OwnSession

_SESSION = ".mcap"  # suffix of a session file; any other name is that of a `.npz`
AGAIN = 0.5  # s between checks whether this process is in the foreground again
_LARGEST = 4096  # bytes of one read; only a line's end matters, not its text


class EnterKey:
    """Calls the function `call` in the running event loop when standard input delivers a line."""

    def __init__(self, call: Callable[[], object]) -> None:
        self._call, self._loop = call, get_running_loop()
        self._stopped, self._listening = threading.Event(), False
        try:
            self._source = sys.stdin.fileno()
        except (AttributeError, OSError, ValueError):  # closed, or the process has none
            return
        if hasattr(signal, "SIGTTIN"):
            # By default a terminal stops a background process that reads; `_read` retries instead.
            signal.signal(signal.SIGTTIN, signal.SIG_IGN)
        self._listening = True
        # A thread, because not every event loop can wait for a terminal, and none for a file.
        threading.Thread(target=self._listen, name="enter key", daemon=True).start()

    def listening(self) -> bool:
        """Return whether lines can still come: standard input exists and has not ended."""
        return self._listening

    def stop(self) -> None:
        """Stop listening; a thread that waits for a key goes on until the process ends."""
        self._stopped.set()

    def _report(self) -> None:
        if not self._stopped.is_set():
            self._call()

    def _listen(self) -> None:
        while not self._stopped.is_set():
            text = self._read()
            if text is None:  # the end of the input: no line can come any more
                break
            if b"\n" in text:
                try:
                    self._loop.call_soon_threadsafe(self._report)
                except RuntimeError:  # the loop has ended meanwhile
                    break
        self._listening = False

    def _read(self) -> bytes | None:
        """Return bytes of standard input; None at its end, empty after a failed read."""
        try:
            return os.read(self._source, _LARGEST) or None
        except OSError:
            # A terminal refuses reads in the background; the process may come to the foreground.
            if not os.isatty(self._source):
                return None
            self._stopped.wait(AGAIN)
            return b""


_REFRESH = 0.1  # s
# Bytes of output that may wait for a slow reader: some seconds of the state.
_UNREAD = 32 * 1024


CLOCKS = 1.0  # s between notes of the clocks in a recording; they drift by microseconds in it


async def touching(settings: ClientSettings, record: Output | None, json_lines: bool) -> None:
    """Run a client until it is cancelled, its duration is over, or the server is lost for good.

    Args:
        record: File for the recording of every haptic period; None for no recording.
        json_lines: Whether the state is printed as lines of JSON for a program.

    Raises:
        CohapticError: One of the errors of `Client.run`.
        OutputError: Nothing was recorded although that was asked for, or not all.
        SettingError: Another program records to that file.
    """
    # A stopped terminal or a pipe without a reader must not hold up the network.
    terminal, lines = aside(sys.stderr, _UNREAD), aside(sys.stdout, _UNREAD, lambda count: "")
    console = Console(file=cast(IO[str], terminal))

    def tell(news: str) -> None:
        console.print(f"{settings.name}: {news}", highlight=False, markup=False, soft_wrap=True)

    recorded = _recorded(record, settings, tell)
    try:
        client = Client(settings, tell=tell, keep=recorded.keep if record is not None else None)
    except CohapticError:
        await recorded.finish()
        raise
    recorded.client = client
    summary = Summary(client.clock.now())
    shown = asyncio.ensure_future(_show(client, console, lines if json_lines else None, summary))
    key = EnterKey(client.acknowledge) if settings.holds_faults else None
    if key is not None:
        client.hears = key.listening
    try:
        await client.run()
    finally:
        error = sys.exception()
        if key is not None:
            key.stop()
        shown.cancel()
        await asyncio.gather(shown, return_exceptions=True)
        summary.read(client.status(), client.clock.now())
        if not json_lines and (line := summary.line(client.clock.now())):
            console.print(line, highlight=False, markup=False, soft_wrap=True)
        lost = await recorded.finish()
        # What ended the session says more than what this has done to the recording.
        hidden = isinstance(error, CohapticError)
        if lost is not None and hidden:
            tell(str(lost))
        if isinstance(lines, Aside) and lines.left_out:
            sentence = f"{lines.left_out} lines of the state were left out: nobody read them"
            console.print(f"{settings.name}: {sentence}", highlight=False, markup=False)
        for stream in (lines, terminal):
            if isinstance(stream, Aside):
                await asyncio.to_thread(stream.drain)
        if lost is not None and not hidden:
            raise lost from None


def _recorded(
    record: Output | None, settings: ClientSettings, tell: Callable[[str], None]
) -> _Recorded | OwnSession:
    if record is None or record.path.suffix != _SESSION:
        return _Recorded(record, settings, tell)
    # Imported here, since a client that records nothing needs none of it.
    from cohaptic_client.own_session import OwnSession as Made

    return Made(record.path, tell, _aside(tell))


class _Recorded:
    """The recording of a client to a `.npz`; without a file for it there is none.

    Args:
        record: File for the recording; None for no recording.
        tell: Function that shows a piece of news to the user.

    Raises:
        SettingError: Another program records to that file, or it cannot be made.

    Attributes:
        client: The client that is recorded; None before it is made.
    """

    def __init__(
        self, record: Output | None, settings: ClientSettings, tell: Callable[[str], None]
    ) -> None:
        self.client: Client | None = None
        self._tell = tell
        self._noted = -math.inf  # time of the newest note of the clocks [s]
        self._recorder: Recorder | None = None
        if record is not None:
            self._recorder = Recorder(
                record.path, name=settings.name, loop_hz=settings.loop_hz,
                overwrite=record.overwrite, tell=_aside(tell),
                rules=reasons_of(settings.rules),
            )  # fmt: skip

    def keep(self, rows: bytes) -> None:
        """Record rows of the client's loop."""
        if self._recorder is None or self.client is None:
            return
        body = self.client.body
        self._recorder.keep(rows, ZERO if body is None else body.origin)
        if (t := last_row(rows).t) >= self._noted + CLOCKS:
            self._noted = t
            self._recorder.note(self.client.clocks())

    async def finish(self) -> OutputError | None:
        """Finish the recording, and say what was recorded; return what has gone wrong with it."""
        if self._recorder is None:
            return None
        if self.client is not None:
            self._recorder.note(self.client.clocks())
        try:
            self._tell(await asyncio.to_thread(self._recorder.finish))
        except OutputError as lost:
            return lost
        return None


def _aside(tell: Callable[[str], None]) -> Callable[[str], None]:
    """Return a function that any thread may call, which calls `tell` in the running event loop."""
    loop = get_running_loop()

    def call(news: str) -> None:
        with contextlib.suppress(RuntimeError):  # the loop has ended meanwhile
            loop.call_soon_threadsafe(tell, news)

    return call


async def _show(
    client: Client, console: Console, lines: Aside | TextIO | None, summary: Summary
) -> None:
    """Show the client's state in a terminal, or write it as JSON to `lines`, until cancelled."""
    if lines is not None:
        while True:
            lines.write(client.status().model_dump_json() + "\n")
            lines.flush()
            await asyncio.sleep(_REFRESH)
    clock = client.clock
    if not console.is_terminal:
        reported = clock.now()
        while True:
            await asyncio.sleep(_REFRESH)
            status = client.status()
            summary.read(status, clock.now())
            if clock.now() - reported >= EVERY and status.state != "connecting":
                reported = clock.now()
                console.print(status_line(status), highlight=False, markup=False, soft_wrap=True)
    # Imported here: it is a third of all imports, and not needed for output to a program.
    from rich.live import Live

    from cohaptic.status.table import status_view

    with Live(console=console, refresh_per_second=10, transient=True) as live:
        while True:
            status = client.status()
            summary.read(status, clock.now())
            live.update(status_view([status], width=console.width))
            await asyncio.sleep(_REFRESH)
