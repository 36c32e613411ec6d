"""Ends a refused connection with one sentence as an HTTP response, without waiting."""

from __future__ import annotations

import contextlib
import socket

from cohaptic_server.guard.sources import Refusal


def turn_away(connection: socket.socket, refusal: Refusal, status: int = 429) -> None:
    """Send the reason of a refusal, if it can be sent without waiting; close the connection."""
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
