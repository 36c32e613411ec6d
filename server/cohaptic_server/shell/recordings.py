"""Begins and ends the recordings of one server: one at a time, and none overwrites a file."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable, Coroutine
from functools import partial
from typing import TYPE_CHECKING, Any

from cohaptic.errors import CohapticError, SettingError
from cohaptic.sessions.entries import SessionInfo, Written
from cohaptic.sessions.recorder import open_recorder
from cohaptic_server.room.input_record import ColumnRecord, InputRecord
from cohaptic_server.room.peer import Outcome, Peer
from cohaptic_server.shell.recording import Keeper, Recording, info_of

if TYPE_CHECKING:
    from cohaptic_server.shell.server import CohapticServer

log = logging.getLogger("cohaptic.server")


class Recordings:
    """The recordings of a server.

    Args:
        server: The server.

    Attributes:
        current: Recording in progress; None while nothing records the session.
    """

    def __init__(self, server: CohapticServer) -> None:
        self.current: Recording | None = None
        self._server = server
        self._changing: set[asyncio.Task[None]] = set()  # recordings that begin or end
        # One change after the other, so that people are told of them in their order.
        self._one = asyncio.Lock()

    @property
    def columns(self) -> ColumnRecord | None:
        """Takes down what happens with columns; None while nothing records the session."""
        record = self._server.room.record
        if record is None:
            return None
        return lambda kind: record.write(kind(self._server.clock.now()))

    async def begin(self, target: str, option: str = "--record") -> None:
        """Record the session from now on, and tell everybody in the room.

        Args:
            target: Path of a session file that does not exist yet, or of a folder.
            option: Option by which the operator named the target.

        Raises:
            SettingError: The session is recorded already, or the file cannot be made.
            OutputError: The first bytes of the file cannot be written.
        """
        await self.begin_by(_opens(target, option), option, target)

    async def begin_by(
        self, opens: Callable[[SessionInfo], Keeper], option: str, target: str
    ) -> None:
        """Record the session from now on by what `opens` makes, in a thread; else as `begin`."""
        async with self._one:
            await self._begin_by(opens, option, target)

    async def _begin_by(
        self, opens: Callable[[SessionInfo], Keeper], option: str, target: str
    ) -> None:
        server, room = self._server, self._server.room
        if room.record is not None:
            raise SettingError(option, target, "given while nothing else records the session")
        now = server.clock.now()
        info = info_of(room, now, server.clock.to_wall())
        waiting: list[Written] = []  # until the disk has answered
        record = room.record = InputRecord(waiting.append, room.members.values(), now)
        try:
            recorder = await asyncio.to_thread(opens, info)
        except BaseException:
            room.record = None
            raise
        if server.room is not room:
            recorder.finish()
            raise SettingError(option, target, "given while the object stays: it has just changed")
        for entry in waiting:
            recorder.add(entry)
        record.write = recorder.add
        self.current = Recording(recorder, room, now, follows=server.web.model is not None)
        log.info("recording to %s", recorder.path)
        server.carry_out(server.session_host.tell_recorded(on=True))

    async def end(self, why: str = "", only: Keeper | None = None) -> None:
        """End the recording, if there is one, and tell everybody in the room.

        Args:
            why: Reason for the log; empty where somebody has asked for it.
            only: Keeper of the recording to end; None for any.
        """
        async with self._one:
            if self.current is not None and only in (None, self.current.recorder):
                await self._end(self.current, why)

    async def _end(self, recording: Recording, why: str) -> None:
        self.current = None
        if why:
            log.warning("the recording ends: %s", why)
        log.info("%s", await recording.end())
        self._server.carry_out(self._server.session_host.tell_recorded(on=False))

    async def close(self) -> None:
        """End the recording with the server."""
        await asyncio.gather(*self._changing, return_exceptions=True)
        await self.end()

    def after_tick(self) -> None:
        """Add what the last tick has made."""
        recording = self.current
        if recording is None:
            return
        if not recording.recorder.ended:
            recording.after_tick(self._server.web.ticked)
        elif not self._changing:  # the disk is full: nobody is recorded any more
            self._start(self.end(only=recording.recorder))

    def take(self, outcome: Outcome) -> None:
        """Take what an outcome has for the recording."""
        if self.current is not None:
            now = self._server.clock.now()
            for line in outcome.log:
                self.current.note(line, now)
            for mark, user in outcome.marks:
                self.current.mark(mark, user, now)
            for rows, of in outcome.rows:
                self.current.rows(rows, of, now)
        for admin, on in outcome.recordings:
            self._start(self._change(admin, on=on))

    def _start(self, work: Coroutine[Any, Any, None]) -> None:
        task = asyncio.ensure_future(work)
        self._changing.add(task)
        task.add_done_callback(self._changing.discard)

    async def _change(self, admin: Peer, *, on: bool) -> None:
        """Begin or end a recording, as an administrator asks, and answer."""
        server = self._server
        async with self._one:
            done = await self._changed(on=on)
        server.carry_out(server.session_host.answer_recording(admin, begins=on, done=done))

    async def _changed(self, *, on: bool) -> bool:
        target, option = self._server.settings.recordings, "--recordings"
        try:
            if on:
                await self._begin_by(_opens(target, option), option, target)
            elif self.current is not None:
                await self._end(self.current, "")
            else:
                return False
        except CohapticError as error:
            log.warning("%s", error)
            return False
        return True


def _opens(target: str, option: str) -> Callable[[SessionInfo], Keeper]:
    # The recording wakes the thread after each tick, so that none waits for it.
    return partial(open_recorder, target, tell=log.warning, option=option, batch=None)
