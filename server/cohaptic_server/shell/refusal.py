"""The end of a connection that never came to a room: one sentence to it, and a close code."""

from __future__ import annotations

import contextlib

from websockets.exceptions import ConnectionClosed

from cohaptic.errors import CloseCode, one_line
from cohaptic.protocol.messages import Error, encode_control
from cohaptic.room_address import split_path
from cohaptic_server.room.session import close_frame
from cohaptic_server.shell.wire import Wire


async def refuse(ws: Wire, code: CloseCode, why: str) -> None:
    """Tell why, and close."""
    with contextlib.suppress(ConnectionClosed):
        await ws.send(encode_control(Error(code=code.value, message=why)))
        await ws.close(*close_frame(code.value, why))


async def refuse_other_room(ws: Wire, room: str | None) -> bool:
    """Tell one who asked for another room that it is not here; returns whether it did."""
    asked = split_path(ws.request.path)[0] if ws.request is not None else None
    if asked is None or asked == room:
        return False
    await refuse(ws, CloseCode.NO_ROOM, f"there is no room {one_line(asked)} here")
    return True
