"""A file in the pieces in which it is mutated, so that faults also reach what is packed.

A bit that is flipped in a zip or a gzip stream changes its checksum, and the reader looks no
further. A draft therefore has the unpacked pieces and the way to pack them.
"""

from __future__ import annotations

import base64
import gzip
import io
import json
import struct
import zipfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

Pack = Callable[[Sequence[bytes]], bytes]


def joined(pieces: Sequence[bytes]) -> bytes:
    """The pieces one after another, as they are."""
    return b"".join(pieces)


def zipped(names: Sequence[str]) -> Pack:
    """Packs pieces as the members of a zip, which has no date of its own."""

    def pack(pieces: Sequence[bytes]) -> bytes:
        file = io.BytesIO()
        with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
            for name, piece in zip(names, pieces, strict=True):
                archive.writestr(zipfile.ZipInfo(name), piece)
        return file.getvalue()

    return pack


def gzipped(pieces: Sequence[bytes]) -> bytes:
    """The pieces as one gzip stream without a date."""
    return gzip.compress(joined(pieces), mtime=0)


def header_and_gzipped(pieces: Sequence[bytes]) -> bytes:
    """The first piece as it is, and the others as one gzip stream."""
    return pieces[0] + gzipped(pieces[1:])


def glb(pieces: Sequence[bytes]) -> bytes:
    """JSON and binary data as the chunks of a .glb, with lengths that are right."""
    text, blob = pieces
    text += b" " * (-len(text) % 4)
    blob += b"\0" * (-len(blob) % 4)
    body = struct.pack("<I4s", len(text), b"JSON") + text
    body += struct.pack("<I4s", len(blob), b"BIN\0") + blob
    return struct.pack("<4sII", b"glTF", 2, 12 + len(body)) + body


DATA = b"data:application/octet-stream;base64,"
PLACE = "DATA"  # stands in the JSON where the binary data of a .gltf goes


def gltf(pieces: Sequence[bytes]) -> bytes:
    """JSON with the binary data in it."""
    return pieces[0].replace(PLACE.encode(), DATA + base64.b64encode(pieces[1]))


def text_of(document: Any) -> bytes:
    """JSON text of a document."""
    return json.dumps(document).encode()


@dataclass(frozen=True, eq=False)
class Draft:
    """A file in pieces.

    Args:
        name: Name of its shape and form.
        pieces: Bytes that are mutated.
        pack: Makes the file of the pieces.
        volume: Volume of the object in it [m^3].
        within: Largest relative error of the volume that reading may make.
    """

    name: str
    pieces: tuple[bytes, ...]
    volume: float
    pack: Pack = joined
    within: float = 1e-5

    def packed(self) -> bytes:
        """The bytes of the file."""
        return self.pack(self.pieces)

    def whole(self) -> Draft:
        """The same file in one piece, so that a mutation also reaches its packing."""
        return replace(self, pieces=(self.packed(),), pack=joined)

    def changed(self, index: int, piece: bytes) -> Draft:
        """A copy with another piece."""
        pieces = (*self.pieces[:index], piece, *self.pieces[index + 1 :])
        return replace(self, pieces=pieces)
