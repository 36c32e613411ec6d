"""Message from server to client, sent once if mesh patches are asked for: the resting surface.

The mesh is an event: the server sends it between the welcome and the first patch. Vertices and
faces are deflated together; their counts are checked before anything is inflated.
"""

from __future__ import annotations

import zlib
from dataclasses import dataclass

from cohaptic.errors import RemoteProtocolError
from cohaptic.protocol.fields import FrameKind
from cohaptic.protocol.frame import (
    HEADER,
    MAX_POSITION,
    check_range,
    check_vector,
    open_header,
)
from cohaptic.protocol.layout import FACE, REST_MESH, VERTEX
from cohaptic.protocol.version import PROTOCOL_VERSION
from cohaptic.vec import Vec3

COUNTS = REST_MESH.packer()
_VERTEX = VERTEX.packer()
_FACE = FACE.packer()
MAX_VERTICES = 65_535  # a patch numbers them with 16 bits
MAX_FACES = 131_070  # a closed surface has 2 n - 4
# Deflate adds five bytes to every 16 kB that it cannot shorten.
MAX_BYTES = 1024 + (MAX_VERTICES * _VERTEX.size + MAX_FACES * _FACE.size) * 1001 // 1000
QUANTISED = 1  # flag of the quantised form, which is not exact (`quantised_mesh.py`)
Face = tuple[int, int, int]


@dataclass(frozen=True, slots=True)
class RestMesh:
    """The resting surface of the body.

    Args:
        vertices: Positions of the vertices, shape (n, 3) [m].
        faces: Indices of vertices, counter-clockwise seen from outside, shape (m, 3).
    """

    vertices: tuple[Vec3, ...]
    faces: tuple[Face, ...]

    def encode(self) -> bytes:
        """The frame of this mesh; raises LocalProtocolError when a value is out of its limits."""
        self._check(remote=False)
        raw = b"".join(_VERTEX.pack(*v) for v in self.vertices)
        raw += b"".join(_FACE.pack(*f) for f in self.faces)
        return (
            HEADER.pack(PROTOCOL_VERSION, FrameKind.REST_MESH, 0)
            + COUNTS.pack(len(self.vertices), len(self.faces))
            + zlib.compress(raw)
        )

    @classmethod
    def decode(cls, data: bytes) -> RestMesh:
        """The mesh in a frame; raises RemoteProtocolError for any invalid bytes."""
        flags = open_header(data, FrameKind.REST_MESH)
        if flags == QUANTISED:
            raise RemoteProtocolError(
                "rest mesh", "quantised", "an exact one: no other was asked for"
            )
        check_range("flags of a rest mesh", flags, 0, 0, remote=True)
        start = REST_MESH.size
        if not start < len(data) <= MAX_BYTES:
            limit = f"from {start + 1} to {MAX_BYTES} bytes"
            raise RemoteProtocolError("length of a rest mesh", len(data), limit)
        n, m = COUNTS.unpack_from(data, HEADER.size)
        check_counts(n, m, remote=True)
        split = n * _VERTEX.size
        raw = inflate(data[start:], split + m * _FACE.size)
        mesh = cls(tuple(_VERTEX.iter_unpack(raw[:split])), tuple(_FACE.iter_unpack(raw[split:])))
        mesh._check(remote=True)
        return mesh

    def _check(self, *, remote: bool) -> None:
        n = len(self.vertices)
        check_counts(n, len(self.faces), remote=remote)
        for vertex in self.vertices:
            check_vector("vertex of a rest mesh", vertex, MAX_POSITION, "m", remote=remote)
        for face in self.faces:
            check_range("corner of a face", min(face), 0, n - 1, remote=remote)
            check_range("corner of a face", max(face), 0, n - 1, remote=remote)


def check_counts(n: int, m: int, *, remote: bool) -> None:
    """Raise unless a frame can hold n vertices and m faces."""
    check_range("vertices of a rest mesh", n, 3, MAX_VERTICES, remote=remote)
    check_range("faces of a rest mesh", m, 1, MAX_FACES, remote=remote)


def inflate(deflated: bytes, size: int, of: str = "a rest mesh") -> bytes:
    """The inflated bytes; raises RemoteProtocolError unless they are exactly `size` bytes.

    At most one byte more than `size` is inflated, to bound the memory.
    """
    stream = zlib.decompressobj()
    try:
        # One byte more than expected detects a longer stream.
        raw = stream.decompress(deflated, size + 1)
    except zlib.error as error:
        raise RemoteProtocolError(f"content of {of}", str(error), "a zlib stream") from error
    if len(raw) != size or not stream.eof or stream.unused_data:
        size_found = "more" if len(raw) > size or stream.unused_data else len(raw)
        raise RemoteProtocolError(f"inflated size of {of}", size_found, f"{size} bytes")
    return raw
