"""Files of strangers: whatever is in them is read, or refused by name, with bounded memory."""

from __future__ import annotations

import random
import struct
import tracemalloc
import zlib
from collections.abc import Callable
from pathlib import Path

import pytest
import zstandard
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.writer import CompressionType, Writer

from cohaptic.errors import SettingError
from cohaptic.sessions.codec import encode
from cohaptic.sessions.container import LARGEST_CHUNK, MAGIC
from cohaptic.sessions.entries import Damage, Entry, SessionInfo, Ticked, Written
from cohaptic.sessions.reader import Outline, read_entries
from cohaptic.sessions.schemas import BY_ENTRY, CHANNELS, FORM
from tests.examples_of_laws import examples
from tests.shared.sessions.made import T, info, session, write

HEADER = bytes([1]) + struct.pack("<Q", 8) + bytes(8)
MOST = 3 * LARGEST_CHUNK  # bytes: a chunk, its records, and what is made of them


def read(path: Path) -> list[Entry] | str:
    """The entries of a file, or the words with which it is refused."""
    try:
        found = list(read_entries(path))
    except SettingError as error:
        return str(error)
    Outline.of(path)
    return found


def record(kind: int, data: bytes, length: int | None = None) -> bytes:
    return struct.pack("<BQ", kind, len(data) if length is None else length) + data


def chunk(
    data: bytes, *, size: int | None = None, name: bytes = b"zstd", packed: bytes = b""
) -> bytes:
    packed = packed or zstandard.compress(data)
    head = struct.pack("<QQQI", 0, 1, len(data) if size is None else size, zlib.crc32(data))
    return record(
        6, head + struct.pack("<I", len(name)) + name + struct.pack("<Q", len(packed)) + packed
    )


BOMB = zstandard.ZstdCompressor(level=19).compress(bytes(2**31 - 1 - 2**30))  # 1 GB in 100 kB

FOREIGN: dict[str, tuple[bytes, str]] = {
    "nothing": (b"", "an MCAP file"),
    "text": (b"time,force\n0,1\n", "an MCAP file"),
    "a zip": (b"PK\x03\x04" + bytes(50), "an MCAP file"),
    "only the magic": (MAGIC, "cut short in its first record"),
    "no header": (MAGIC + record(5, bytes(30)) + MAGIC, "begins with its header"),
    "an endless header": (MAGIC + record(1, b"", 2**63), "cut short in its first record"),
    "an empty file": (MAGIC + HEADER + MAGIC, "a session of cohaptic"),
    "an endless record": (MAGIC + HEADER + record(5, b"", 2**64 - 1), "a session of cohaptic"),
    "a large chunk": (MAGIC + HEADER + record(6, bytes(40), 2**40), "chunks of at most"),
    "a bomb": (MAGIC + HEADER + chunk(b"", size=2**30, packed=BOMB), "chunks of at most"),
    "a bomb that lies": (MAGIC + HEADER + chunk(b"", size=1000, packed=BOMB), "records are whole"),
    "an unknown compression": (MAGIC + HEADER + chunk(b"", name=b"xz", packed=b"1"), "by zstd or"),
    "no zstd": (MAGIC + HEADER + chunk(b"", size=9, packed=b"123456789"), "without damage"),
    "no lz4": (MAGIC + HEADER + chunk(b"", size=9, name=b"lz4", packed=b"1"), "without damage"),
    "a broken channel": (MAGIC + HEADER + chunk(record(4, b"\xff" * 9)), "channels are whole"),
    "a short message": (MAGIC + HEADER + chunk(record(5, bytes(9))), "messages are whole"),
    "a cut record": (MAGIC + HEADER + chunk(record(5, bytes(30), 99)), "records are whole"),
    "a short chunk": (MAGIC + HEADER + record(6, bytes(5)) + bytes(99), "chunks are whole"),
}  # fmt: skip


@pytest.mark.parametrize("name", FOREIGN)
def test_what_is_no_session_is_refused_by_name_with_bounded_memory(
    tmp_path: Path, name: str
) -> None:
    data, words = FOREIGN[name]
    path = tmp_path / "x.mcap"
    path.write_bytes(data)
    tracemalloc.start()
    found = read(path)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert isinstance(found, str)
    assert f"session is {path}; it must be " in found
    assert words in found
    assert peak < MOST


def test_what_is_no_file_is_refused(tmp_path: Path) -> None:
    assert "it must be a file" in str(read(tmp_path))
    assert "No such file or directory" in str(read(tmp_path / "none.mcap"))


def test_a_file_of_a_later_form_is_refused(tmp_path: Path) -> None:
    path = write(tmp_path / "x.mcap", session(0.2))
    data = path.read_bytes()
    path.write_bytes(data.replace(f"; form {FORM}".encode(), b"; form 9"))
    assert "a newer version of cohaptic reads it" in str(read(path))


def made_by_others(
    path: Path, fill: Callable[[Writer, dict[str, int]], None], **options: object
) -> Path:
    """A file that the library of MCAP writes, with our channels."""
    with path.open("wb") as file:
        writer = Writer(file, **options)  # type: ignore[arg-type]
        writer.start("another", "another library")
        numbers = {
            channel.topic: writer.register_channel(
                channel.topic,
                channel.encoding,
                writer.register_schema(channel.schema.name, channel.schema.encoding, b""),
            )
            for channel in reversed(CHANNELS)
        }
        fill(writer, numbers)
        writer.finish()  # type: ignore[no-untyped-call]
    return path


@pytest.mark.parametrize("compression", CompressionType)
def test_a_file_that_another_tool_has_written_again_is_read(
    tmp_path: Path, compression: CompressionType
) -> None:
    def fill(writer: Writer, numbers: dict[str, int]) -> None:
        entries: list[Written] = [info(), *(Ticked(T + i, i) for i in range(50))]
        for entry in entries:
            topic = BY_ENTRY[type(entry)].topic
            time = round((entry.t + 1.8e9) * 1e9)
            writer.add_message(numbers[topic], time, encode(entry), time)

    path = made_by_others(tmp_path / "x.mcap", fill, compression=compression, chunk_size=1000)
    assert read(path) == [info(), *(Ticked(T + i, i) for i in range(50))]
    assert list(read_entries(path, T + 20, T + 22)) == [Ticked(T + 20, 20), Ticked(T + 21, 21)]


def test_an_entry_that_no_writer_writes_is_refused(tmp_path: Path) -> None:
    for i, (topic, data, words) in enumerate(
        [
            ("/marks", b'{"t":1,"text":5,"fields":{},"by":null}', "a valid string"),
            ("/marks", b"[" * 100_000, "Invalid JSON"),
            ("/marks", b'{"t":1e300,"text":"","fields":{},"by":null}', "not within 1e"),
            ("/room/tick", b"\xff" * 20, "more than 64 bits"),
            ("/client/rows", b"", "begin with 't'"),
        ]
    ):

        def fill(
            writer: Writer, numbers: dict[str, int], topic: str = topic, data: bytes = data
        ) -> None:
            writer.add_message(numbers["/session"], 0, encode(info()), 0)
            writer.add_message(numbers[topic], 1, data, 1)

        found = read(made_by_others(tmp_path / f"{i}.mcap", fill))
        assert f"a file whose entries are right (one on {topic}: " in str(found)
        assert words in str(found)


def test_an_index_that_names_a_chunk_again_and_again_is_not_believed(tmp_path: Path) -> None:
    """Each would be read: a small file would take hours."""

    def fill(writer: Writer, numbers: dict[str, int]) -> None:
        writer.add_message(numbers["/session"], 0, encode(info()), 0)
        writer.add_message(numbers["/room/tick"], 1, encode(Ticked(T, 1)), 1)
        writer.flush()  # type: ignore[no-untyped-call]
        index = getattr(writer, "_Writer__chunk_indices")  # noqa: B009
        index.extend(list(index) * 1000)

    found = read(made_by_others(tmp_path / "x.mcap", fill))
    # As a file without an index, which may have had more.
    assert found == [info(), Ticked(T, 1), Damage(-info().to_wall, cut_short=True)]


def test_times_at_random_do_not_fill_the_memory(tmp_path: Path) -> None:
    """A later chunk has the earliest time of all: everything before it would have to wait."""

    def fill(writer: Writer, numbers: dict[str, int]) -> None:
        writer.add_message(numbers["/session"], 0, encode(info()), 0)
        mark = b'{"t":1,"text":"%s","fields":{},"by":null}' % (b"x" * 4_000_000)
        for i in range(80):
            writer.add_message(numbers["/marks"], 10**9 + i, mark, 0)
        writer.add_message(numbers["/marks"], 1, mark, 0)

    path = made_by_others(tmp_path / "x.mcap", fill)
    assert path.stat().st_size < 1_000_000
    assert "about in the order of their times" in str(read(path))


@given(st.data())
@settings(max_examples=examples(300))
def test_any_change_of_a_file_is_read_or_refused_by_name(
    tmp_path_factory: pytest.TempPathFactory, data: st.DataObject
) -> None:
    """Bytes are changed, doubled, removed; also where the index is, whose checksum is mended."""
    folder = tmp_path_factory.mktemp("law")
    content = bytearray(write(folder / "x.mcap", session(0.1, users=1)).read_bytes())
    for _ in range(data.draw(st.integers(1, 3))):
        at = data.draw(st.integers(0, len(content) - 1))
        kind = data.draw(st.integers(0, 3))
        if kind == 0:
            content[at] = data.draw(st.integers(0, 255))
        elif kind == 1:
            content[at : at + 8] = data.draw(st.binary(min_size=8, max_size=8))
        elif kind == 2:
            del content[at : at + data.draw(st.integers(1, 2000))]
        else:
            content[at:at] = content[at : at + data.draw(st.integers(1, 2000))]
        if not content:
            return
    if len(content) > 37:
        footer = len(content) - 37
        start = int.from_bytes(content[footer + 9 : footer + 17], "little")
        if start < footer:
            checksum = zlib.crc32(content[start : footer + 25])
            content[footer + 25 : footer + 29] = checksum.to_bytes(4, "little")
    path = folder / "changed.mcap"
    path.write_bytes(content)
    found = read(path)
    if isinstance(found, str):
        assert str(path) in found
    else:
        assert any(isinstance(entry, SessionInfo) for entry in found)


def test_random_bytes_behind_a_right_beginning_are_no_exception(tmp_path: Path) -> None:
    noise = random.Random(1)
    whole = write(tmp_path / "x.mcap", session(0.1, users=1)).read_bytes()
    first = whole.index(b"zstd", whole.index(b"zstd") + 4) - 41  # where the second chunk begins
    for i in range(20):
        path = tmp_path / f"{i}.mcap"
        path.write_bytes(whole[:first] + noise.randbytes(3000))
        found = read(path)
        assert isinstance(found, str) or found[0] == info()
