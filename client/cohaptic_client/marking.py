"""Sets marks in the recording of a session, over a connection that watches the room."""

from __future__ import annotations

import asyncio
import contextlib
import json
import sys
import threading
from collections.abc import AsyncGenerator, AsyncIterator
from typing import Any, cast

from websockets.asyncio.client import ClientConnection
from websockets.exceptions import ConnectionClosed

from cohaptic.errors import SettingError
from cohaptic.protocol.ack import Ack
from cohaptic.protocol.fields import FrameKind
from cohaptic.protocol.messages import MAX_MARK_AGE, Error, Mark, Recorded, encode_control
from cohaptic.protocol.scene_users import decode_users
from cohaptic.protocol.watch_messages import decode_watch_control
from cohaptic_client.moderation import opened, watch_text
from cohaptic_client.network.conversation import Refused
from cohaptic_client.network.marks import NOT_RECORDED, PACE, Stamps, mark_of
from cohaptic_client.network.server_clock import FIRST, ServerClock

_SCENE = bytes((FrameKind.SCENE,))
_MOST_LINES = 1000  # of standard input that wait; a program that writes more is held up
# s for the first scenes and pings, before marks leave without the server's clock. A room at rest
# sends two scenes a second.
_CLOCK = 2.0
_RATE = 10.0  # scenes a second
_LOOK = 0.02  # s between looks whether it is known
_PING = 2.0  # s between two pings, after the first few
_PATIENCE = 15.0  # s for the first answers; a server gives them within 1 s


class Marking:
    """Sets marks in the recording of one room; `marking` makes it.

    Args:
        ws: Connection that watches the room.
    """

    def __init__(self, ws: ClientConnection) -> None:
        self._ws, self._loop = ws, asyncio.get_running_loop()
        self._next = self._loop.time()
        self.clock, self._stamps = ServerClock(), Stamps()
        self.hearing = asyncio.ensure_future(_hear(ws, self.clock))
        self._pinging = asyncio.ensure_future(keep_time(ws, self.clock))

    async def put(self, mark: Mark) -> None:
        """Set a mark, at most `1 / PACE` a second; its time stays that of the call.

        Raises:
            SettingError: The recording has ended.
            Refused: The server refuses the marks of this connection.
        """
        called = self._loop.time()
        await asyncio.wait((self.hearing,), timeout=max(0.0, self._next - called))
        if self.hearing.done():
            self.hearing.result()
        now = self._loop.time()
        self._next = now + PACE
        made = self._stamps.on(mark, called - mark.ago, now, self.clock.reading)
        await self._ws.send(encode_control(made))

    async def know_clock(self) -> None:
        """Return once the server's clock is known, or after `_CLOCK`."""
        until = self._loop.time() + _CLOCK
        while self.clock.reading is None and self._loop.time() < until:
            await asyncio.wait((self.hearing,), timeout=_LOOK)
            if self.hearing.done():
                return

    async def close(self) -> None:
        """End what runs beside."""
        for task in (self.hearing, self._pinging):
            task.cancel()
        await asyncio.gather(self.hearing, self._pinging, return_exceptions=True)

    async def settle(self) -> None:
        """Return when the server has taken all marks, or raise an error as `put` does."""
        # What the server has against a mark comes before the answer to this ping.
        pong = asyncio.ensure_future(await self._ws.ping())
        ends = asyncio.FIRST_COMPLETED
        await asyncio.wait((pong, self.hearing), timeout=_PATIENCE, return_when=ends)
        if self.hearing.done():
            self.hearing.result()


@contextlib.asynccontextmanager
async def marking(url: str, token: str = "", ca_file: str = "") -> AsyncGenerator[Marking]:
    """Connect to a room whose session is recorded.

    Args:
        url: Address of the room.
        token: Token of an invitation; empty for none.
        ca_file: File with the certificates to trust; empty for the system's certificates.

    Raises:
        SettingError: Nothing records the session, or it is no longer recorded.
        ServerLost: No cohaptic server answers.
        Refused: The server refuses the connection or a mark.
    """
    async with opened(url, ca_file) as ws:
        await ws.send(watch_text(token, _RATE))
        async with asyncio.timeout(_PATIENCE):
            if not await _is_recorded(ws):
                raise SettingError("mark", f"for {url}", NOT_RECORDED)
        made = Marking(ws)
        try:
            await made.know_clock()
            yield made
            await made.settle()
        finally:
            await made.close()


async def _is_recorded(ws: ClientConnection) -> bool:
    """Return whether the server says so before it begins with the mesh."""
    while True:
        data = await ws.recv()
        if isinstance(data, bytes):
            return False
        message = decode_watch_control(data)
        if isinstance(message, Error):
            raise Refused(message.code, message.message, message.field)
        if isinstance(message, Recorded):
            return message.on


async def keep_time(ws: ClientConnection, clock: ServerClock) -> None:
    """Measure round trips for a clock until the connection ends."""
    loop, count = asyncio.get_running_loop(), 0
    with contextlib.suppress(ConnectionClosed):
        while True:
            trip = await (await ws.ping())
            clock.answered(trip, loop.time())
            count += 1
            await asyncio.sleep(_PING if count >= FIRST else 0.0)


async def _hear(ws: ClientConnection, clock: ServerClock) -> None:
    """Read what comes, until the recording or the connection ends."""
    loop = asyncio.get_running_loop()
    async for data in ws:
        if isinstance(data, bytes):
            if data[1:2] == _SCENE:  # the server ends a connection that reads none
                scene = decode_users(data)
                clock.heard(scene.t_server, loop.time())
                await ws.send(Ack(scene.tick).encode())
            continue
        message = decode_watch_control(data)
        if isinstance(message, Error):
            raise Refused(message.code, message.message, message.field)
        if isinstance(message, Recorded) and not message.on:
            raise SettingError("mark", "set", "set before the recording has ended")


async def set_one(url: str, token: str, ca_file: str, mark: Mark) -> None:
    """Set one mark; the arguments and errors are those of `marking`."""
    loop = asyncio.get_running_loop()
    begun = loop.time()
    async with marking(url, token, ca_file) as made:
        ago = mark.ago + loop.time() - begun  # the marked moment was before the connection
        await made.put(mark.model_copy(update={"ago": ago}))


async def set_stream(url: str, token: str, ca_file: str, marks: AsyncIterator[Mark]) -> None:
    """Set each mark of a stream until it ends, or until the recording does, which is an error.

    The other arguments, and the errors, are those of `marking`.
    """
    async with marking(url, token, ca_file) as made:

        async def pump() -> None:
            async for mark in marks:
                await made.put(mark)

        pumping = asyncio.ensure_future(pump())
        ends = asyncio.FIRST_COMPLETED
        await asyncio.wait((pumping, made.hearing), return_when=ends)
        if made.hearing.done():
            pumping.cancel()
            made.hearing.result()
        await pumping


async def from_lines() -> AsyncGenerator[Mark]:
    """Yield a mark for each line of standard input.

    Raises:
        SettingError: A line is out of the limits of a mark.
    """
    loop = asyncio.get_running_loop()
    lines: asyncio.Queue[tuple[float, str]] = asyncio.Queue()
    room = threading.Semaphore(_MOST_LINES)

    def read() -> None:
        # A thread of its own, which ends with the process: a read cannot be ended.
        with contextlib.suppress(RuntimeError):  # the loop has ended meanwhile
            while line := sys.stdin.readline():
                room.acquire()
                loop.call_soon_threadsafe(lines.put_nowait, (loop.time(), line))
            loop.call_soon_threadsafe(lines.put_nowait, (loop.time(), ""))

    threading.Thread(target=read, name="lines", daemon=True).start()
    while (taken := await lines.get())[1]:
        room.release()
        at, line = taken
        if text := line.strip():
            ago = min(MAX_MARK_AGE, loop.time() - at)
            yield mark_of_line(text).model_copy(update={"ago": ago})


def mark_of_line(line: str) -> Mark:
    """Return the mark of a line: a JSON object with `text` and further values, or plain text.

    Raises:
        SettingError: A value is out of its limits.
    """
    try:
        said = json.loads(line)
    except (ValueError, RecursionError):
        said = None
    if not isinstance(said, dict):
        return mark_of(line, {})
    fields = cast("dict[str, Any]", said)
    text = fields.pop("text", "")
    return mark_of(text, fields)
