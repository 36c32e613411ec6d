"""Cuts the stream of a server into frames, so that a patch can be used as soon as it comes.

All other frames are passed on to `websockets`, which checks them. A hostile stream cannot fill the
memory: only the beginning of one frame with at most `LONGEST` bytes of payload is kept.
"""

from __future__ import annotations

from typing import NamedTuple

from cohaptic.protocol.websocket_frames import BINARY, begins_message, read_head

# Largest payload that is kept until it is complete [bytes]: a few of the largest patches. Parts of
# a longer one, such as a rest mesh, are passed on at once.
LONGEST = 4096


class Piece(NamedTuple):
    """A part of the stream.

    Args:
        data: Bytes of the stream, unchanged.
        patch: Payload of a whole binary message without mask; None in all other pieces.
        begins: Whether a message begins with this piece.
    """

    data: bytes
    patch: bytes | None
    begins: bool


class ServerStream:
    """Cuts the bytes that a server sends after its answer to the handshake."""

    def __init__(self) -> None:
        self._rest: bytes = b""  # incomplete frame, from its first byte
        self._passing = 0  # bytes of a long frame that are still to come

    def cut(self, data: bytes) -> list[Piece]:
        """Return the pieces that `data` completes, in order; all pieces joined give the stream."""
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
