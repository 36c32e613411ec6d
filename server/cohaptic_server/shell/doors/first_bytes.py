"""Whether a connection has said enough to be worth a transport: the head of a request, or a hello.

What is not told apart here is passed on, to be judged where it is read.
"""

from __future__ import annotations

from cohaptic.protocol.websocket_frames import END_OF_HEAD

MOST = (
    4096  # bytes that are looked at; of a longer head, or hello of TLS, the rest is not waited for
)
_HANDSHAKE = b"\x16"  # of TLS: the type of a record, two bytes of version, two of its length follow
_RECORD_HEAD = 5


def has_asked(seen: bytes, *, tls: bool) -> bool:
    """Whether it has asked for something.

    Args:
        seen: All that has come so far, or the first `MOST` bytes of it; not empty.
        tls: Whether it has to begin with a handshake.
    """
    if len(seen) >= MOST:
        return True
    if not tls:
        return END_OF_HEAD in seen or not seen[:1].isalpha()
    if seen[:1] != _HANDSHAKE:
        return True
    length = _RECORD_HEAD + int.from_bytes(seen[3:_RECORD_HEAD])
    return len(seen) >= max(length, _RECORD_HEAD)
