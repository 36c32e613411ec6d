"""The end of a connection that never came to a room: one sentence to it, and a close code."""

from __future__ import annotations

import contextlib

from websockets.exceptions import ConnectionClosed

from cohaptic.errors import CloseCode
from cohaptic.protocol.messages import Error, encode_control
from cohaptic_server.room.session import close_frame
from cohaptic_server.shell.wire import Wire


async def refuse(ws: Wire, code: CloseCode, why: str) -> None:
    """Tell why, and close."""
    with contextlib.suppress(ConnectionClosed):
        await ws.send(encode_control(Error(code=code.value, message=why)))
        await ws.close(*close_frame(code.value, why))
