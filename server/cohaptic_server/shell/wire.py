"""A websocket of the library whose samples pass by its parser, its queue and the handler's task.

At 60 messages a second and user, those cost more than all that the server does with a sample. Here,
the frame of a sample is handed over as it came; all else goes by the library, and while any of it
waits for the handler, so do samples: messages stay in order.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from websockets.asyncio.server import ServerConnection
from websockets.protocol import State

from cohaptic.protocol.websocket_frames import begins_message, make_frame
from cohaptic_server.shell.frames import ClientStream, is_small_binary

MAX_INBOUND_BYTES = 4096  # the largest inbound message is a hello; this is several of them


class Wire(ServerConnection):
    """The connection to one client.

    Attributes:
        deliver: Called with the frame of each small binary message that comes while the handler
            waits for a message; None leaves all messages to `recv`.
    """

    def __init__(self, *args: Any, **options: Any) -> None:
        super().__init__(*args, **options)
        self.deliver: Callable[[bytes], None] | None = None
        self._stream = ClientStream(MAX_INBOUND_BYTES)
        self._waiting = 0  # messages that the library has and the handler has not taken

    def allow(self, longest: int) -> None:
        """Take messages of up to so many bytes on this connection."""
        self._stream.allow(longest)
        self.protocol.max_message_size = longest

    def taken(self) -> None:
        """The handler is done with a message of `recv`."""
        self._waiting -= 1

    def write(self, messages: list[str | bytes]) -> None:
        """Write messages without waiting, in one system call; nothing once the close has begun."""
        if messages and self.state is State.OPEN:
            self.transport.write(b"".join(map(make_frame, messages)))

    def data_received(self, data: bytes) -> None:
        """Called by the event loop with bytes of the client."""
        in_head = not self._stream.opened
        for piece in self._stream.cut(data):
            # Nothing may be ahead of a message that is delivered at once.
            if self.deliver is not None and not self._waiting and is_small_binary(piece):
                if self.state is State.OPEN:
                    self.deliver(piece)
                    continue
            self._waiting += not in_head and begins_message(piece)
            in_head = False
            super().data_received(piece)
