"""The journal of a recording in progress: blocks that are only ever appended. Functions of bytes.

A file is a sequence of blocks, each with a head and a payload. The head has a mark, the kind, the
length of the payload and a checksum of all that, so that a block that was cut short, as by a killed
process or a full disk, or damaged later, is noticed. After damage, reading goes on at the next
whole block.

    H  header: JSON with the user's name, the names of the columns and the rate of the loop
    R  rows: origin of their frame, then rows of `cohaptic.status.row.ROW`, compressed by zlib
    C  clocks: the values of one `Clocks`
"""

from __future__ import annotations

import json
import math
import struct
import zlib
from collections.abc import Generator
from typing import BinaryIO, NamedTuple

from cohaptic.vec import Vec3


class Header(NamedTuple):
    """What holds for a whole recording.

    Args:
        name: Name of the user.
        columns: Names of the columns of a row.
        loop_hz: Rows per second [Hz].
    """

    name: str
    columns: tuple[str, ...]
    loop_hz: float


class Clocks(NamedTuple):
    """How the client's clock stood to others at one time; NaN for what was not known.

    Args:
        t: Time on the client's clock, as in the rows [s].
        to_wall: Unix time of the client's machine less its clock [s].
        to_server: The server's clock less the client's [s].
        error: Bound on the error of `to_server` [s].
        server_to_wall: Unix time of the server's machine less the server's clock [s].
    """

    t: float
    to_wall: float
    to_server: float = math.nan
    error: float = math.nan
    server_to_wall: float = math.nan


class RowBlock(NamedTuple):
    """Some rows in one frame.

    Args:
        origin: Origin of the rows' frame, as a point of the scaled file of the object [m].
        rows: The rows, one behind the other.
    """

    origin: Vec3
    rows: bytes


class Damage(NamedTuple):
    """Bytes that are no whole block.

    Args:
        size: How many they are.
        at_end: Whether no whole block follows, as where a write was cut short.
    """

    size: int
    at_end: bool


Entry = Header | RowBlock | Clocks | Damage

MARK = b"\x93coh"  # not ASCII, so that no text looks like a journal
_HEAD = struct.Struct("<4scII")  # mark, kind, length of the payload, checksum
_START = struct.Struct("<4scI")  # the part of the head that the checksum covers
_ORIGIN = struct.Struct("<3d")
_CLOCKS = struct.Struct("<5d")
# Most rows of a block [bytes]: a damaged length must not make a reader take all memory. The loop's
# ring holds 1.4 MB of rows; the writer splits longer blocks.
MOST = 4 * 1024 * 1024
# Of zlib: a third of a millisecond for a tenth of a second. Higher levels take four times as long
# for a tenth less.
LEVEL = 1
_SEARCHED = 64 * 1024  # bytes that a search for the next mark reads at once


def header_block(header: Header) -> bytes:
    """Return the block with which a journal begins."""
    return _block(b"H", json.dumps(header._asdict()).encode())


def rows_block(block: RowBlock) -> bytes:
    """Return a block of rows, at most `MOST` bytes of them."""
    return _block(b"R", _ORIGIN.pack(*block.origin) + zlib.compress(block.rows, LEVEL))


def clocks_block(clocks: Clocks) -> bytes:
    """Return a block for the clocks at one time."""
    return _block(b"C", _CLOCKS.pack(*clocks))


def entries(file: BinaryIO) -> Generator[Entry, None, None]:
    """Yield the entries of a journal in order, with bounded memory.

    What is damaged is yielded as `Damage`, once for each stretch of bytes.

    Args:
        file: Journal, opened for reading in binary; it is read from its beginning, as far as it
            reaches at the time of the call.
    """
    size = file.seek(0, 2)
    at = whole = 0  # where to read next, and the end of the last whole block
    while at < size:
        found = _entry_at(file, at)
        if found is None:
            at = _next_mark(file, at + 1, size)
            continue
        if at > whole:
            yield Damage(at - whole, at_end=False)
        entry, at = found
        whole = at
        yield entry
    if size > whole:
        yield Damage(size - whole, at_end=True)


def _block(kind: bytes, payload: bytes) -> bytes:
    start = _START.pack(MARK, kind, len(payload))
    return start + struct.pack("<I", zlib.crc32(payload, zlib.crc32(start))) + payload


def _entry_at(file: BinaryIO, at: int) -> tuple[Entry, int] | None:
    """Return the entry that begins at a byte, and where it ends; None if no whole one does."""
    file.seek(at)
    head = file.read(_HEAD.size)
    if len(head) < _HEAD.size:
        return None
    mark, kind, length, check = _HEAD.unpack(head)
    if mark != MARK or length > 2 * MOST:  # what cannot be compressed becomes a little longer
        return None
    payload = file.read(length)
    if zlib.crc32(payload, zlib.crc32(head[: _START.size])) != check or len(payload) < length:
        return None
    entry = _entry(kind, payload)
    return None if entry is None else (entry, at + _HEAD.size + length)


def _entry(kind: bytes, payload: bytes) -> Entry | None:
    """Return the entry of a block whose checksum is right; None for one of another version."""
    if kind == b"R":
        rows = zlib.decompressobj().decompress(payload[_ORIGIN.size :], MOST)
        return RowBlock(_ORIGIN.unpack_from(payload), rows)
    if kind == b"C" and len(payload) == _CLOCKS.size:
        return Clocks(*_CLOCKS.unpack(payload))
    if kind == b"H":
        found = json.loads(payload)
        return Header(found["name"], tuple(found["columns"]), found["loop_hz"])
    return None


def _next_mark(file: BinaryIO, at: int, size: int) -> int:
    """Return where the next mark begins, from a byte on; the size of the file if there is none."""
    while at < size:
        file.seek(at)
        part = file.read(_SEARCHED)
        found = part.find(MARK)
        if found >= 0:
            return at + found
        if len(part) < len(MARK):
            break
        at += len(part) - len(MARK) + 1  # a mark may lie across two parts
    return size
