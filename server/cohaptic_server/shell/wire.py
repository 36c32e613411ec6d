"""A websocket of the library whose samples are read as they come, without a queue and a task.

The library reads each message in three steps: its parser queues a frame, the queue wakes the task
of the handler, and the task takes the message. At 60 messages a second and user that costs more
than all that the server does with a sample. Here, a sample that comes alone goes straight to its
session; all else goes by the library, and while any of it waits for the handler, so do samples, so
that messages stay in order.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from websockets.asyncio.server import ServerConnection
from websockets.protocol import State

from cohaptic_server.shell.frames import ClientStream, begins_message, make_frame, small_binary

MAX_INBOUND_BYTES = 4096  # the largest inbound message is a hello; this is several of them


class Wire(ServerConnection):
    """The connection to one client.

    Attributes:
        deliver: Called with each sample that comes while the handler waits for a message; None
            leaves all messages to `recv`.
    """

    def __init__(self, *args: Any, **options: Any) -> None:
        super().__init__(*args, **options)
        self.deliver: Callable[[bytes], None] | None = None
        self._stream = ClientStream(MAX_INBOUND_BYTES)
        self._waiting = 0  # messages that the library has and the handler has not taken

    def taken(self) -> None:
        """The handler is done with a message of `recv`."""
        self._waiting -= 1

    def write(self, messages: list[str | bytes]) -> None:
        """Write messages without waiting, in one system call; nothing once the close has begun."""
        if messages and self.state is State.OPEN:
            self.transport.write(b"".join(map(make_frame, messages)))

    def data_received(self, data: bytes) -> None:
        """Called by the event loop with bytes of the client."""
        if self._free and self._stream.between_frames:
            message = small_binary(data)
            if message is not None and self.deliver is not None:
                self.deliver(message)
                return
        in_head = not self._stream.opened
        for piece in self._stream.cut(data):
            self._waiting += not in_head and begins_message(piece)
            in_head = False
            super().data_received(piece)

    @property
    def _free(self) -> bool:
        """Whether no message is ahead of one that comes now."""
        return not self._waiting and self.deliver is not None and self.state is State.OPEN
