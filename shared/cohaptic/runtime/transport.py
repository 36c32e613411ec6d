"""Network settings of a connection, the same for every connection and at both ends.

`docs/design/wire.md` explains the settings.
"""

from __future__ import annotations

import asyncio
import socket
from collections.abc import Callable
from typing import Any

WEBSOCKET_OPTIONS: dict[str, Any] = {
    # Frames are packed already; deflate would cost 50 kB of memory and time per connection.
    "compression": None,
    # At most a few samples or patches wait: the newest replaces the others.
    "max_queue": (8, 2),
    # Above this much unsent data `send` would wait; the Outbox never reaches that amount.
    "write_limit": (65536, 16384),
    "open_timeout": 5,
    "close_timeout": 2,
    # A peer that vanished silently is noticed within 15 s; its force is released after 0.5 s.
    "ping_interval": 5,
    "ping_timeout": 10,
}
# Bytes that may wait in the kernel. The default lets megabytes of old patches pile up behind a
# stalled path; with this bound a few dozen wait, and the newest one can still be replaced.
NOT_SENT_LOWAT = 4096
USER_TIMEOUT_MS = 10_000


def unsent_of(transport: asyncio.Transport) -> Callable[[], int]:
    """Return a function that counts the bytes that wait in a transport's buffers in this process.

    Under TLS asyncio's own count omits the buffer of the transport below TLS, which may have 64 kB
    of old patches: a stalled connection would look as if it were not stalled.
    """
    below = getattr(getattr(transport, "_ssl_protocol", None), "_transport", None)
    if below is None:
        return transport.get_write_buffer_size
    above, under = transport.get_write_buffer_size, below.get_write_buffer_size
    return lambda: above() + under()


def tune(sock: socket.socket) -> None:
    """Set the TCP options of a connected socket.

    TCP_NODELAY is set here because asyncio leaves it off on some sockets that it did not create.
    TCP_NOTSENT_LOWAT exists on Linux and macOS, TCP_USER_TIMEOUT on Linux; elsewhere the defaults
    stay.
    """
    sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    for name, value in (
        ("TCP_NOTSENT_LOWAT", NOT_SENT_LOWAT),
        ("TCP_USER_TIMEOUT", USER_TIMEOUT_MS),
    ):
        option = getattr(socket, name, None)
        if option is not None:
            sock.setsockopt(socket.IPPROTO_TCP, option, value)
