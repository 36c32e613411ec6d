"""Chunks of an MCAP file, also of one without an end, and of one that a stranger has made.

Nothing of a file is believed before it is compared with what the file can hold: each length with
the size of the file, each size of a chunk with a limit, each chunk with its checksum. What does not
hold is `Unreadable`.

The index at the end of a file says where its chunks are. A killed process writes none; then one
pass over the heads of the records finds them, without reading their contents.
"""

from __future__ import annotations

import importlib
import os
import struct
import zlib
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from io import BytesIO
from itertools import pairwise
from typing import Any, BinaryIO, NamedTuple

import zstandard
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Channel, ChunkIndex, Footer, Header, Statistics

MAGIC = b"\x89MCAP0\r\n"
# Bytes of a chunk, compressed or not. Ours have 4 MB at most, those of the tools of MCAP as much.
LARGEST_CHUNK = 64 * 1024 * 1024
_LARGEST_SUMMARY = 64 * 1024 * 1024  # bytes; an hour of ours has one of 2 MB
_MOST_RECORDS = 2_000_000  # outside chunks; an hour of ours has 100,000
_MOST_CHANNELS = 10_000  # ours has some twenty and one for each user
_HEAD = struct.Struct("<BQ")  # kind of a record, and its length
_CHUNK = struct.Struct("<QQQII")  # start, end, size, checksum, length of the compression's name
_MESSAGE = struct.Struct("<HIQQ")  # channel, sequence, two times
_FOOTER_SIZE = _HEAD.size + 20
_INDEX_ENTRY = 16  # bytes of a message's entry in the index behind a chunk
_COMPRESSIONS = {b"", b"zstd", b"lz4"}
_BROKEN = (ValueError, McapError, struct.error)  # what the library raises for a broken record


class Unreadable(Exception):
    """What a file holds is no MCAP file, or is damaged; the text completes "it must be ..."."""


class Span(NamedTuple):
    """A chunk of the file.

    Args:
        start: Earliest time of its messages [ns].
        end: Latest time of its messages [ns].
        at: Where its record begins [bytes].
        size: Bytes of its record that are there.
        whole: Whether all of it is there.
        counts: Messages by number of the channel; None if the file has no index of the chunk.
    """

    start: int
    end: int
    at: int
    size: int
    whole: bool
    counts: dict[int, int] | None


class Item(NamedTuple):
    """A message: number of its channel, time [ns], and data."""

    channel: int
    time: int
    data: bytes


@dataclass
class Container:
    """An open MCAP file.

    Args:
        file: The file, opened for reading in binary.
        size: Its size [bytes].
        library: Name of the program that wrote it.
        spans: Its chunks, in the order of the file.
        channels: Topic and encoding by number of the channel; more are added as chunks are read.
        complete: Whether the file has the index with which a writer ends it.
        totals: Messages by number of the channel, if the file has an index.
    """

    file: BinaryIO
    size: int
    library: str = ""
    spans: list[Span] = field(default_factory=list[Span])
    channels: dict[int, tuple[str, str]] = field(default_factory=dict[int, tuple[str, str]])
    complete: bool = False
    totals: Counter[int] = field(default_factory=Counter[int])

    @classmethod
    def of(cls, file: BinaryIO) -> Container:
        """Find the chunks of a file.

        Raises:
            Unreadable: The file is no MCAP file, or nothing of it is there.
            OSError: It cannot be read.
        """
        size = file.seek(0, os.SEEK_END)
        file.seek(0)
        if file.read(len(MAGIC)) != MAGIC:
            raise Unreadable("an MCAP file, as `cohaptic serve --record` writes them")
        found = cls(file, size)
        found._read_header()
        if not found._read_summary():
            found._find_spans()
        return found

    def items(self, span: Span) -> list[Item]:
        """Return the messages of a chunk in the order of the file; of a cut one, what is there.

        Raises:
            Unreadable: The chunk is damaged, or too large.
            OSError: The file cannot be read.
        """
        self.file.seek(span.at + _HEAD.size)
        content = self.file.read(span.size - _HEAD.size)
        data = _unpacked(content, whole=span.whole)
        return list(self._records(data, whole=span.whole))

    def _read_header(self) -> None:
        kind, data, _ = self._record(len(MAGIC), 64 * 1024)
        if kind != Opcode.HEADER:
            raise Unreadable("an MCAP file that begins with its header")
        try:
            self.library = Header.read(_stream(data)).library
        except _BROKEN as error:
            raise Unreadable("an MCAP file with a header") from error

    def _read_summary(self) -> bool:
        """Read the index at the end; return whether there is a whole one that can be right."""
        self.file.seek(max(0, self.size - _FOOTER_SIZE - len(MAGIC)))
        tail = self.file.read(_FOOTER_SIZE + len(MAGIC))
        if len(tail) < _FOOTER_SIZE + len(MAGIC) or not tail.endswith(MAGIC):
            return False
        if _HEAD.unpack_from(tail) != (Opcode.FOOTER, 20):
            return False
        footer = Footer.read(_stream(tail[_HEAD.size :]))
        end = self.size - _FOOTER_SIZE - len(MAGIC)
        if not 0 < footer.summary_start < end <= footer.summary_start + _LARGEST_SUMMARY:
            return False
        self.file.seek(footer.summary_start)
        data = self.file.read(end - footer.summary_start)
        covered = data + tail[: _FOOTER_SIZE - 4]
        if footer.summary_crc and zlib.crc32(covered) != footer.summary_crc:
            return False
        spans, channels, totals = list[Span](), dict[int, tuple[str, str]](), Counter[int]()
        try:
            for kind, record in _records(data):
                if kind == Opcode.CHUNK_INDEX:
                    spans.append(self._indexed(ChunkIndex.read(_stream(record))))
                elif kind == Opcode.CHANNEL:
                    channel = Channel.read(_stream(record))
                    channels[channel.id] = channel.topic, channel.message_encoding
                elif kind == Opcode.STATISTICS:
                    totals.update(Statistics.read(_stream(record)).channel_message_counts)
        except (Unreadable, *_BROKEN):
            return False
        if not spans or len(channels) > _MOST_CHANNELS:
            return False
        spans.sort(key=lambda span: span.at)
        if any(one.at + one.size > other.at for one, other in pairwise(spans)):
            return False  # chunks within others would be read again and again
        self.spans = spans
        self.channels, self.totals, self.complete = channels, totals, True
        return True

    def _indexed(self, index: ChunkIndex) -> Span:
        end = index.chunk_start_offset + index.chunk_length
        if index.chunk_length > LARGEST_CHUNK + 1024 or end > self.size:
            raise Unreadable("an MCAP file whose index is right")
        counts = dict.fromkeys(index.message_index_offsets, 1)  # at least
        return Span(
            index.message_start_time,
            index.message_end_time,
            index.chunk_start_offset,
            index.chunk_length,
            True,
            counts or None,
        )

    def _find_spans(self) -> None:
        """Find the chunks by the heads of all records, and count by the index behind each."""
        at, records = len(MAGIC), 0
        while at + _HEAD.size <= self.size:
            records += 1
            if records > _MOST_RECORDS:
                raise Unreadable(f"a file with at most {_MOST_RECORDS:,} records")
            self.file.seek(at)
            head = self.file.read(_HEAD.size + _CHUNK.size)
            kind, length = _HEAD.unpack_from(head)
            end = at + _HEAD.size + length
            if kind == Opcode.CHUNK and len(head) == _HEAD.size + _CHUNK.size:
                start, last, *_ = _CHUNK.unpack_from(head, _HEAD.size)
                if length > LARGEST_CHUNK + 1024:
                    raise Unreadable(f"a file with chunks of at most {LARGEST_CHUNK:,} bytes")
                there = min(end, self.size) - at
                self.spans.append(Span(start, last, at, there, end <= self.size, None))
            elif kind == Opcode.MESSAGE_INDEX and end <= self.size and self.spans:
                self._count(head, length)
            elif kind == Opcode.DATA_END:
                return
            at = end
        if self.spans:  # the index behind the last chunk may be cut short
            self.spans[-1] = self.spans[-1]._replace(counts=None)

    def _count(self, head: bytes, length: int) -> None:
        """Note how many messages of one channel the last chunk has, by the index behind it."""
        channel, size = struct.unpack_from("<HI", head, _HEAD.size)
        span = self.spans[-1]
        if size == length - 6:
            counts = (span.counts or {}) | {channel: size // _INDEX_ENTRY}
            self.spans[-1] = span._replace(counts=counts)

    def _record(self, at: int, limit: int) -> tuple[int, bytes, int]:
        """Return kind and content of a record, and where the next begins."""
        self.file.seek(at)
        head = self.file.read(_HEAD.size)
        if len(head) < _HEAD.size:
            raise Unreadable("a file that is not cut short in its first record")
        kind, length = _HEAD.unpack(head)
        if length > min(limit, self.size - at - _HEAD.size):
            raise Unreadable("a file that is not cut short in its first record")
        return kind, self.file.read(length), at + _HEAD.size + length

    def _records(self, data: bytes, *, whole: bool) -> Iterator[Item]:
        """Yield the messages in a chunk's content, and take note of its channels."""
        for kind, record in _records(data, whole=whole):
            if kind == Opcode.MESSAGE:
                if len(record) < _MESSAGE.size:
                    raise Unreadable("a file whose messages are whole")
                channel, _, time, _ = _MESSAGE.unpack_from(record)
                yield Item(channel, time, record[_MESSAGE.size :])
            elif kind == Opcode.CHANNEL:
                try:
                    channel = Channel.read(_stream(record))
                except _BROKEN as error:
                    raise Unreadable("a file whose channels are whole") from error
                if channel.id not in self.channels and len(self.channels) >= _MOST_CHANNELS:
                    raise Unreadable(f"a file with at most {_MOST_CHANNELS:,} channels")
                self.channels[channel.id] = channel.topic, channel.message_encoding


def _stream(data: bytes) -> ReadDataStream:
    return ReadDataStream(BytesIO(data))


def _records(data: bytes, *, whole: bool = True) -> Iterator[tuple[int, bytes]]:
    """Yield kinds and contents of the records in some bytes.

    Raises:
        Unreadable: The last is cut short, and the bytes should be whole.
    """
    at = 0
    while at + _HEAD.size <= len(data):
        kind, length = _HEAD.unpack_from(data, at)
        at += _HEAD.size
        if at + length > len(data):
            break
        yield kind, data[at : at + length]
        at += length
    else:
        if at == len(data):
            return
    if whole:
        raise Unreadable("a file whose records are whole")


def _unpacked(content: bytes, *, whole: bool) -> bytes:
    """Return the records of a chunk; of one that is cut short, those that are there.

    Raises:
        Unreadable: It is too large, of an unknown compression, or damaged.
    """
    if len(content) < _CHUNK.size:
        if whole:
            raise Unreadable("a file whose chunks are whole")
        return b""
    _, _, size, checksum, length = _CHUNK.unpack_from(content)
    name = content[_CHUNK.size : _CHUNK.size + length] if length <= 8 else b"another"
    at = _CHUNK.size + length + 8
    if at > len(content):
        if whole:
            raise Unreadable("a file whose chunks are whole")
        return b""
    if size > LARGEST_CHUNK:
        raise Unreadable(f"a file with chunks of at most {LARGEST_CHUNK:,} bytes")
    if name not in _COMPRESSIONS:
        raise Unreadable("a file that is compressed by zstd or lz4, or not at all")
    data = _decompressed(name, content[at:], size)
    if whole and (len(data) != size or (checksum and zlib.crc32(data) != checksum)):
        raise Unreadable("a file without damage")
    return data


def _decompressed(name: bytes, data: bytes, size: int) -> bytes:
    """Return at most `size` bytes, and fewer where the data is cut short."""
    if name == b"":
        return data[:size]
    if name == b"lz4":
        frame: Any = importlib.import_module("lz4.frame")  # which has no types
        try:
            found: bytes = frame.LZ4FrameDecompressor().decompress(data, max_length=size)
        except RuntimeError as error:
            raise Unreadable("a file without damage") from error
        return found
    try:
        # A stream, since a frame may claim any size, and may be cut short.
        with zstandard.ZstdDecompressor(max_window_size=LARGEST_CHUNK).stream_reader(data) as file:
            return file.read(size)
    except zstandard.ZstdError as error:
        raise Unreadable("a file without damage") from error
