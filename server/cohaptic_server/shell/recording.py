"""A session that a server records: from the inputs of its room to the scenes of its watchers.

What a tick adds is written after its patches, so that nobody waits for it.
"""

from __future__ import annotations

import asyncio
import struct
from pathlib import Path
from typing import Protocol

from pydantic_core import to_jsonable_python

from cohaptic import __version__
from cohaptic.errors import LocalProtocolError, OutputError
from cohaptic.protocol.messages import MAX_MARK_AGE
from cohaptic.protocol.messages import Mark as MarkMessage
from cohaptic.protocol.scene import encode_scene
from cohaptic.protocol.scene_surface import FINEST, Surface
from cohaptic.protocol.traversal import Traversal
from cohaptic.protocol.version import PROTOCOL_VERSION
from cohaptic.sessions.entries import (
    Happened,
    Link,
    Mark,
    Mesh,
    Patched,
    Rows,
    RowsLost,
    SessionInfo,
    Shown,
    Written,
)
from cohaptic.status.row import ROW, columns_with
from cohaptic.status.row_batch import RowBatch
from cohaptic_server.bodies.body import elastic_of
from cohaptic_server.guard.limits import FULL, Budget, spend
from cohaptic_server.room.body_frames import describe
from cohaptic_server.room.peer import LogLine
from cohaptic_server.room.room import Room
from cohaptic_server.room.watch.scene_broadcast import displacement, records
from cohaptic_server.shell.column_worker import HasColumns
from cohaptic_server.world.users import is_at_rest

_TIME = struct.Struct("<d")  # the first number of a row
_MAX_AGE = 60.0  # s of rows that a stall has held up
# Rows of a user: a loop makes 4,000 a second at most. What a stall has held up comes at once.
_ROWS = Budget(5000, 50_000)
_LINK = 1.0  # s between two records of the state of a link
_STILL = 0.5  # s between two scenes of a body at rest, as for a page that watches
# s between two scenes with the surface, of a body whose surface is not in its contacts: a page
# draws what lies between two, and a body of 10,000 vertices takes 20 kB each time.
_SURFACE = 1.0 / 15.0
# Lines of the log of which the inputs of the room tell more.
_KNOWN = frozenset({"joined", "left"})


class Keeper(Protocol):
    """Takes the entries of a session: a `SessionRecorder`, or a program elsewhere."""

    path: Path

    @property
    def ended(self) -> bool:
        """Whether it takes no more, as where the disk is full."""
        ...

    def add(self, entry: Written) -> None:
        """Add an entry without waiting."""
        ...

    def wake(self) -> None:
        """Begin to keep what waits, since a tick is over."""
        ...

    def finish(self) -> str:
        """Keep what waits; return a sentence for the log; raises OutputError if that fails."""
        ...


class Recording:
    """A recording in progress.

    Args:
        recorder: Keeps the entries.
        room: Room that is recorded.
        follows: Whether the surface of the body follows from the contacts of the moment.
        now: Time [s].
    """

    def __init__(self, recorder: Keeper, room: Room, now: float, *, follows: bool) -> None:
        self.recorder = recorder
        self._room = room
        self._begun = now
        self._linked: dict[int, float] = {}  # time of the last record of a user's link [s]
        self._rows: dict[int, float] = {}  # buckets of the users, as of `guard/limits.py`
        self._traversal = None if follows else _traversal(room)
        self._shown = self._with_surface = -_STILL
        if room.frames.has_rest_mesh:
            recorder.add(Mesh(now, room.frames.shown_mesh()))

    @property
    def path(self) -> Path:
        """Path of the file."""
        return self.recorder.path

    def after_tick(self, now: float) -> None:
        """Add what a tick has made.

        Args:
            now: Time of the tick [s].
        """
        self._add_tick(now)
        self.recorder.wake()

    def _add_tick(self, now: float) -> None:
        room, tick = self._room, self._room.world.tick
        for user, patch in room.patches.items():
            try:
                self.recorder.add(Patched(now, tick, user, patch.encode()))
            except LocalProtocolError:  # out of the range of the wire: the user has not got it
                continue
        if not room.world.users and is_at_rest(room.world) and now - self._shown < _STILL:
            return
        self._shown = now
        try:
            self.recorder.add(Shown(now, tick, self._scene(now)))
        except LocalProtocolError:  # as for a patch
            pass

    def _scene(self, now: float) -> bytes:
        world, tail = self._room.world, b""
        if self._traversal is not None and now - self._with_surface >= _SURFACE:
            self._with_surface = now
            shape = displacement(world, len(self._room.body.mesh.vertices))
            tail = Surface.of(shape, FINEST).encode(self._traversal)
        users = b"".join(record.encode() for record in records(world, self._room.patches))
        return encode_scene(world.tick, now, world.room, users, tail)

    def note(self, line: LogLine, now: float) -> None:
        """Add a line of the log as an event, unless the room's inputs tell of it."""
        if line.event and line.event not in _KNOWN:
            numbers = {m.hello.name: m.user for m in self._room.members.values()}
            self.recorder.add(Happened(now, line.event, numbers.get(line.user), line.text))

    def mark(self, mark: MarkMessage, by: int | None, now: float) -> None:
        """Add a mark that a user, or somebody who watches, has set."""
        at, error = mark.at, mark.error
        if at is None or abs(now - at) > MAX_MARK_AGE:
            at, error = now - mark.ago, None
        self.recorder.add(Mark(at, mark.text, mark.fields, by, error))

    def rows(self, batch: RowBatch, user: int, now: float) -> None:
        """Add rows of a user's loop, and how many of them are missing."""
        (first,) = _TIME.unpack_from(batch.block)
        (last,) = _TIME.unpack_from(batch.block, len(batch.block) - ROW.size)
        lost, clock, at = batch.lost, batch.clock, first + batch.clock.to_server
        if now - _MAX_AGE <= at < self._begun:
            return  # from before the recording, of which its client was told by another connection
        # A clock is what its client says, and nobody's file has rows of another day for that, nor
        # more of them than a loop makes.
        left = spend(self._rows.get(user, FULL), batch.count, _ROWS, now)
        if left is None or not (abs(now - at) <= _MAX_AGE and last - first <= _MAX_AGE):
            lost, at = lost + batch.count, now
        else:
            self._rows[user] = left
            columns, error = self._columns_of(user), min(clock.error, _MAX_AGE)
            self.recorder.add(Rows(at, user, columns, batch.block, clock.to_server, error))
            if now - self._linked.get(user, -_LINK) >= _LINK:
                self._linked[user] = now
                self.recorder.add(
                    Link(now, user, clock.round_trip, clock.jitter, clock.to_server, error)
                )
        if lost:
            self.recorder.add(RowsLost(at, user, lost))

    def _columns_of(self, user: int) -> tuple[str, ...]:
        member = self._room.members.get(user)
        rules = None if member is None else member.hello.rules
        return columns_with(() if rules is None else rules.added)

    async def end(self) -> str:
        """End the recording; return a sentence for the log."""
        self._room.record = None
        try:
            return await asyncio.to_thread(self.recorder.finish)
        except OutputError as error:
            return str(error)


def _traversal(room: Room) -> Traversal:
    return Traversal.of(len(room.body.mesh.vertices), room.body.mesh.faces)


def info_of(room: Room, now: float, to_wall: float) -> SessionInfo:
    """Return the first entry of a recording of a room.

    Args:
        room: The room.
        now: Time [s].
        to_wall: Unix time less the server's clock [s].
    """
    settings, elastic = room.settings, elastic_of(room.body)
    has_columns = isinstance(elastic, HasColumns)
    known = {
        **to_jsonable_python(settings.made_from),
        # Otherwise there is no beginning from which patches could be computed again. A body that
        # has solved for columns never forgets whom it has met.
        "from_rest": not room.members
        and is_at_rest(room.world)
        and not (has_columns and room.next_user > 1),
        "tick": room.world.tick,
        "laws": [law.value for law in settings.laws],
        "max_users": settings.max_users,
    }
    if isinstance(elastic, HasColumns):
        known["columns"] = "at once" if elastic.at_once else "delivered"
    body = describe(room.body).model_dump(mode="json")
    return SessionInfo(
        now, __version__, PROTOCOL_VERSION, settings.room or "", body,
        settings.simulation_period, to_wall, known,
    )  # fmt: skip
