"""Refuses a client with one sentence: by a close code of its websocket, or by an HTTP response.

A websocket is refused if it asks for another room. The HTTP response is for a connection that is
refused before its request is read; it is sent without waiting.
"""

from __future__ import annotations

import contextlib
import socket

from websockets.exceptions import ConnectionClosed

from cohaptic.errors import CloseCode, one_line
from cohaptic.protocol.messages import Error, encode_control
from cohaptic.room_address import split_path
from cohaptic_server.guard.sources import Refusal
from cohaptic_server.room.session import close_frame
from cohaptic_server.shell.wire import Wire


async def refuse(ws: Wire, code: CloseCode, why: str, field: str = "") -> None:
    """Send the client the reason `why` and the field at fault, and close with `code`."""
    with contextlib.suppress(ConnectionClosed):
        await ws.send(encode_control(Error(code=code.value, field=field, message=why)))
        await ws.close(*close_frame(code.value, why))


def why_not_here(target: str, room: str | None) -> str:
    """Return the reason why an address is not that of this server's room; empty if it is.

    An unknown path does not lead to the room at the root: it may name another room in an unknown
    form, or a proxy may have added a path of its own.

    Args:
        target: Path and query of a request.
        room: Name of the room of this server; None without a name.
    """
    asked, path = split_path(target)
    if asked not in (None, room):
        return f"there is no room {one_line(asked or '', 64)} here"
    if path not in ("", "/"):
        there = one_line(target.partition("?")[0], 100)
        return f"there is no room at {there}, only at / and /r/NAME, below --base-path if given"
    return ""


async def refuse_other_room(ws: Wire, room: str | None) -> bool:
    """Refuse a client that asked for another room; return whether it was refused."""
    why = why_not_here(ws.request.path, room) if ws.request is not None else ""
    if why:
        await refuse(ws, CloseCode.NO_ROOM, why, "room")
    return bool(why)


def turn_away(connection: socket.socket, refusal: Refusal, status: int = 429) -> None:
    """Send the reason of a refusal, unless the client cannot take it now; close the connection."""
    phrase = "Too Many Requests" if status == 429 else "Service Unavailable"
    text = f"{refusal.why}\n".encode()
    head = (
        f"HTTP/1.1 {status} {phrase}\r\nConnection: close\r\nContent-Type: text/plain\r\n"
        f"Retry-After: {int(refusal.retry) + 1}\r\nContent-Length: {len(text)}\r\n\r\n"
    )
    with contextlib.suppress(OSError):
        connection.setblocking(False)
        connection.send(head.encode() + text)
        connection.shutdown(socket.SHUT_WR)
    connection.close()
