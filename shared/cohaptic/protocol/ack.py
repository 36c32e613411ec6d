"""Message from a watching client to the server: the client received and drew a scene frame.

The server keeps at most two frames unacknowledged. A page that falls behind therefore gets fewer
frames rather than older ones, and the server notices a page that has stopped.
"""

from __future__ import annotations

from dataclasses import dataclass

from cohaptic.protocol.fields import FrameKind
from cohaptic.protocol.frame import HEADER, check_range, open_frame
from cohaptic.protocol.layout import ACK
from cohaptic.protocol.version import PROTOCOL_VERSION

_BODY = ACK.packer()
SIZE = ACK.size
_U32 = 2**32 - 1


@dataclass(frozen=True, slots=True)
class Ack:
    """Newest scene frame of a watcher, and whether the watcher needs frames with the surface.

    Args:
        tick: Tick of the newest scene frame received; earlier frames are acknowledged with it.
        wants: 1 if the watcher lacks Green's functions: frames then carry the surface until the
            next ack, whatever the encoding; else 0.
    """

    tick: int
    wants: int = 0

    def encode(self) -> bytes:
        """The frame of this ack; raises LocalProtocolError when a value is out of its limits."""
        self._check(remote=False)
        head = HEADER.pack(PROTOCOL_VERSION, FrameKind.ACK, 0)
        return head + _BODY.pack(self.tick, self.wants)

    @classmethod
    def decode(cls, data: bytes) -> Ack:
        """The ack in a frame; raises RemoteProtocolError for any invalid bytes."""
        open_frame(data, FrameKind.ACK, SIZE)
        ack = cls(*_BODY.unpack_from(data, HEADER.size))
        ack._check(remote=True)
        return ack

    def _check(self, *, remote: bool) -> None:
        check_range("tick of an ack", self.tick, 1, _U32, remote=remote)
        check_range("wants of an ack", self.wants, 0, 1, remote=remote)
