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
from collections.abc import Generator, Mapping
from types import MappingProxyType
from typing import BinaryIO, NamedTuple

from cohaptic.status.row import COLUMNS
from cohaptic.vec import Vec3


class Header(NamedTuple):
    """What holds for a whole recording.

    Args:
        name: Name of the user.
        columns: Names of the columns of a row.
        loop_hz: Rows per second [Hz].
        rules: Rules of other packages in the loop, and the reason of each.
    """

    name: str
    columns: tuple[str, ...]
    loop_hz: float
    rules: Mapping[str, str] = MappingProxyType({})


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
        cut_short: Whether they are the begin of one block, at the end of the file, as where a write
            was cut short.
    """

    size: int
    cut_short: bool


Entry = Header | RowBlock | Clocks | Damage

MARK = b"\x93coh"  # not ASCII, so that no text looks like a journal
_HEAD = struct.Struct("<4scII")  # mark, kind, length of the payload, checksum
_START = struct.Struct("<4scI")  # the part of the head that the checksum covers
_ORIGIN = struct.Struct("<3d")
_CLOCKS = struct.Struct("<5d")
# Most rows of a block [bytes]: a damaged length must not make a reader take all memory. The loop's
# ring holds 3 MB of rows; the writer splits longer blocks.
LARGEST = 4 * 1024 * 1024
# Of zlib: a third of a millisecond for a tenth of a second. Higher levels take four times as long
# for a tenth less.
LEVEL = 1
_SEARCHED = 64 * 1024  # bytes that a search for the next mark reads at once
_MAX_IN_VAIN = 64 * 1024 * 1024  # bytes, of eight of the longest blocks


def header_block(header: Header) -> bytes:
    """Return the block with which a journal begins."""
    return _block(b"H", json.dumps(header._asdict() | {"rules": dict(header.rules)}).encode())


def rows_block(block: RowBlock) -> bytes:
    """Return a block of rows, at most `LARGEST` bytes of them."""
    return _block(b"R", _ORIGIN.pack(*block.origin) + zlib.compress(block.rows, LEVEL))


def clocks_block(clocks: Clocks) -> bytes:
    """Return a block for the clocks at one time."""
    return _block(b"C", _CLOCKS.pack(*clocks))


def entries(file: BinaryIO) -> Generator[Entry, None, None]:
    """Yield the entries of a journal in order, with bounded memory.

    What is damaged is yielded as `Damage`, once for each stretch of bytes. A checksum says nothing
    about who wrote a block, so that one with a content that no recorder writes is damage, too.

    Args:
        file: Journal, opened for reading in binary; it is read from its beginning, as far as it
            reaches at the time of the call.
    """
    size = file.seek(0, 2)
    at = whole = 0  # where to read next, and the end of the last whole block
    width = len(COLUMNS)  # of a row
    in_vain = 0  # bytes that were read for blocks which are not whole
    while at < size:
        found = _entry_at(file, at, size, width)
        if found is None:
            in_vain += file.tell() - at
            # What damage leaves behind has few marks; a file of nothing else would take hours.
            at = _next_mark(file, at + 1, size) if in_vain < _MAX_IN_VAIN else size
            continue
        entry, end = found
        if isinstance(entry, Header):
            if at > 0:  # a recorder begins with it
                at = end
                continue
            width = len(entry.columns)
        if at > whole:
            yield Damage(at - whole, cut_short=False)
        at = whole = end
        yield entry
    if size > whole:
        yield Damage(size - whole, _is_cut_short(file, whole, size))


def _block(kind: bytes, payload: bytes) -> bytes:
    start = _START.pack(MARK, kind, len(payload))
    return start + struct.pack("<I", zlib.crc32(payload, zlib.crc32(start))) + payload


def _entry_at(file: BinaryIO, at: int, size: int, width: int) -> tuple[Entry, int] | None:
    """Return the entry that begins at a byte, and where it ends; None if no whole one does."""
    file.seek(at)
    head = file.read(_HEAD.size)
    if len(head) < _HEAD.size:
        return None
    mark, kind, length, check = _HEAD.unpack(head)
    # What cannot be compressed becomes a little longer.
    if mark != MARK or length > 2 * LARGEST or at + _HEAD.size + length > size:
        return None
    payload = file.read(length)
    if zlib.crc32(payload, zlib.crc32(head[: _START.size])) != check or len(payload) < length:
        return None
    try:
        entry = _entry(kind, payload, width)
    except (ValueError, TypeError, LookupError, RecursionError, struct.error, zlib.error):
        return None
    return None if entry is None else (entry, at + _HEAD.size + length)


def _entry(kind: bytes, payload: bytes, width: int) -> Entry | None:
    """Return the entry of a block whose checksum is right; None for one of another version.

    Raises:
        Exception: No recorder writes such a block; errors of many kinds.
    """
    if kind == b"R":
        unpacker = zlib.decompressobj()
        rows = unpacker.decompress(payload[_ORIGIN.size :], LARGEST)
        if unpacker.eof and len(rows) % (8 * width) == 0:
            return RowBlock(_ORIGIN.unpack_from(payload), rows)
    if kind == b"C" and len(payload) == _CLOCKS.size:
        return Clocks(*_CLOCKS.unpack(payload))
    if kind == b"H":
        found = json.loads(payload)
        name, columns, loop_hz = found["name"], found["columns"], found["loop_hz"]
        if columns and all(isinstance(word, str) for word in (name, *columns)):
            rules = {str(key): str(words) for key, words in found.get("rules", {}).items()}
            return Header(name, tuple(columns), float(loop_hz), rules)
    return None


def _is_cut_short(file: BinaryIO, at: int, size: int) -> bool:
    """Return whether the bytes from `at` to the end are the begin of one block."""
    file.seek(at)
    head = file.read(_HEAD.size)
    if len(head) < _HEAD.size:
        return head[: len(MARK)] == MARK[: len(head)]
    mark, _, length, _ = _HEAD.unpack(head)
    return bool(mark == MARK and length <= 2 * LARGEST and at + _HEAD.size + length > size)


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
