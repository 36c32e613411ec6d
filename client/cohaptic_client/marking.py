"""Sets marks in the recording of a session, over a connection that watches the room."""

from __future__ import annotations

import asyncio
import contextlib
import json
import sys
from collections.abc import AsyncGenerator, AsyncIterator, Callable
from typing import Any, cast

from websockets.asyncio.client import ClientConnection

from cohaptic.errors import SettingError
from cohaptic.protocol.ack import Ack
from cohaptic.protocol.fields import FrameKind
from cohaptic.protocol.messages import Error, Mark, Recorded, encode_control
from cohaptic.protocol.scene_users import decode_users
from cohaptic.protocol.watch_messages import decode_watch_control
from cohaptic_client.moderation import opened, watch_text
from cohaptic_client.network.conversation import Refused
from cohaptic_client.network.marks import NOT_RECORDED, mark_of

_SCENE = bytes((FrameKind.SCENE,))
_PATIENCE = 15.0  # s for the first answers; a server gives them within 1 s


Set = Callable[[Mark], None]


@contextlib.asynccontextmanager
async def marking(url: str, token: str = "", ca_file: str = "") -> AsyncGenerator[Set]:
    """Connect to a room whose session is recorded; yield the function that sets a mark.

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
        await ws.send(watch_text(token))
        async with asyncio.timeout(_PATIENCE):
            if not await _is_recorded(ws):
                raise SettingError("mark", f"for {url}", NOT_RECORDED)
        waiting: asyncio.Queue[Mark] = asyncio.Queue(_MOST_WAITING)
        sending = asyncio.ensure_future(_send(ws, waiting))
        hearing = asyncio.ensure_future(_hear(ws))
        try:
            yield waiting.put_nowait
            sent = asyncio.ensure_future(waiting.join())
            ends = asyncio.FIRST_COMPLETED
            await asyncio.wait((sent, sending, hearing), timeout=_PATIENCE, return_when=ends)
            sent.cancel()
            # What the server has against a mark comes before the answer to this ping.
            pong = asyncio.ensure_future(await ws.ping())
            await asyncio.wait((pong, hearing), timeout=_PATIENCE, return_when=ends)
            if hearing.done():
                hearing.result()
        finally:
            for task in (sending, hearing):
                task.cancel()
            await asyncio.gather(sending, hearing, return_exceptions=True)


_MOST_WAITING = 1000  # marks; more within a moment are a mistake of the program that sets them


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


async def _send(ws: ClientConnection, waiting: asyncio.Queue[Mark]) -> None:
    while True:
        mark = await waiting.get()
        await ws.send(encode_control(mark))
        waiting.task_done()


async def _hear(ws: ClientConnection) -> None:
    """Read what comes, until the recording or the connection ends."""
    async for data in ws:
        if isinstance(data, bytes):
            if data[1:2] == _SCENE:  # the server ends a connection that reads none
                await ws.send(Ack(decode_users(data).tick).encode())
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
    async with marking(url, token, ca_file) as put:
        ago = mark.ago + loop.time() - begun  # the marked moment was before the connection
        put(mark.model_copy(update={"ago": ago}))


async def set_stream(url: str, token: str, ca_file: str, marks: AsyncIterator[Mark]) -> None:
    """Set each mark of a stream until it ends, or until the recording does.

    The other arguments, and the errors, are those of `marking`.
    """
    async with marking(url, token, ca_file) as put:
        async for mark in marks:
            put(mark)


async def from_lines() -> AsyncGenerator[Mark]:
    """Yield a mark for each line of standard input.

    Raises:
        SettingError: A line is out of the limits of a mark.
    """
    while line := await asyncio.to_thread(sys.stdin.readline):
        if text := line.strip():
            yield mark_of_line(text)


def mark_of_line(line: str) -> Mark:
    """Return the mark of a line: a JSON object with `text` and further values, or plain text.

    Raises:
        SettingError: A value is out of its limits.
    """
    try:
        said = json.loads(line)
    except ValueError:
        said = None
    if not isinstance(said, dict):
        return mark_of(line, {})
    fields = cast("dict[str, Any]", said)
    text = fields.pop("text", "")
    return mark_of(text, fields)
