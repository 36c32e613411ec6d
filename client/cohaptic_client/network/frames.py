"""The stream of a server, cut into frames, so that a patch can be taken as it comes.

All else is passed on to `websockets`, which checks it. Of a hostile stream nothing is kept but the
beginning of one frame of at most `LONGEST`.
"""

from __future__ import annotations

from typing import NamedTuple

from cohaptic.protocol.websocket_frames import BINARY, begins_message, read_head

# Payload that may wait for its rest [bytes]: a few of the largest patches. A longer one, such as a
# rest mesh, is passed on as it comes.
LONGEST = 4096


class Piece(NamedTuple):
    """A part of the stream.

    Args:
        data: As it came.
        patch: Payload of a whole binary message without mask; None in all other pieces.
        begins: Whether a message begins here.
    """

    data: bytes
    patch: bytes | None
    begins: bool


class ServerStream:
    """Cuts what a server sends behind its answer to the handshake."""

    def __init__(self) -> None:
        self._rest: bytes = b""  # begins with a frame
        self._passing = 0  # bytes of a long frame that are still to come

    def cut(self, data: bytes) -> list[Piece]:
        """The pieces that are complete with `data`, in order; joined, they are the stream."""
        found: list[Piece] = []
        if self._passing:
            passed = data[: self._passing]
            found.append(Piece(passed, None, begins=False))
            self._passing -= len(passed)
            data = data[len(passed) :]
        elif self._rest:
            data, self._rest = self._rest + data, b""
        at, end = 0, len(data)
        while at < end:
            head = read_head(data, at)
            if head is None:
                break
            stop = at + head.size + head.payload
            if stop > end and head.payload <= LONGEST:
                break
            frame = data[at:stop]
            patch = None
            if frame[0] == BINARY and not head.masked and head.payload <= LONGEST:
                patch = frame[head.size :]
            found.append(Piece(frame, patch, begins_message(frame)))
            self._passing = max(0, stop - end)
            at = min(stop, end)
        self._rest = data[at:]
        return found
