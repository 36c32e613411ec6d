from __future__ import annotations

import io
import struct
import zlib

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cohaptic.recording.journal import (
    LARGEST,
    MARK,
    Clocks,
    Damage,
    Entry,
    Header,
    RowBlock,
    clocks_block,
    entries,
    header_block,
    rows_block,
)
from cohaptic.recording.outline import Outline
from cohaptic.status.row import COLUMNS, ROW
from tests.examples_of_laws import examples
from tests.shared.recording.rows import rows

HEADER = Header("änn\n", COLUMNS, 1000.0)
FEW = examples(60)


def encoded(entry: Entry) -> bytes:
    match entry:
        case Header():
            return header_block(entry)
        case RowBlock():
            return rows_block(entry)
        case Clocks():
            return clocks_block(entry)
        case Damage():
            raise AssertionError


def read(data: bytes) -> list[Entry]:
    return list(entries(io.BytesIO(data)))


@st.composite
def journals(draw: st.DrawFn) -> list[Entry]:
    found: list[Entry] = [HEADER]
    start = 0
    for count in draw(st.lists(st.integers(0, 20), min_size=1, max_size=6)):
        found.append(RowBlock((float(start), 0.0, -1.0), rows(start, start + count)))
        if draw(st.booleans()):
            found.append(Clocks(float(start), 2.0, 3.0, 4.0, 5.0))
        start += count
    return found


@given(journals())
@settings(max_examples=FEW)
def test_what_was_written_is_read(journal: list[Entry]) -> None:
    assert read(b"".join(map(encoded, journal))) == journal


@given(journals(), st.data())
@settings(max_examples=FEW)
def test_a_file_that_was_cut_short_has_a_prefix(journal: list[Entry], data: st.DataObject) -> None:
    """As a killed process or a full disk leaves it: all whole blocks, and a note of the rest."""
    blocks = [encoded(entry) for entry in journal]
    whole = b"".join(blocks)
    cut = data.draw(st.integers(0, len(whole) - 1))
    found = read(whole[:cut])
    ends = [sum(map(len, blocks[: k + 1])) for k in range(len(blocks))]
    kept = sum(end <= cut for end in ends)
    rest = cut - ([0, *ends][kept])
    assert found == [*journal[:kept], *([Damage(rest, cut_short=True)] if rest else [])]


@given(journals(), st.data())
@settings(max_examples=FEW)
def test_a_byte_that_has_changed_is_noticed_and_costs_one_block(
    journal: list[Entry], data: st.DataObject
) -> None:
    blocks = [bytearray(encoded(entry)) for entry in journal]
    k = data.draw(st.integers(0, len(blocks) - 1))
    blocks[k][data.draw(st.integers(0, len(blocks[k]) - 1))] ^= data.draw(st.integers(1, 255))
    damage, *others = [e for e in read(b"".join(blocks)) if isinstance(e, Damage)]
    assert (damage.size, others) == (len(blocks[k]), [])
    assert not damage.cut_short or k == len(blocks) - 1
    assert read(b"".join(blocks)) == [*journal[:k], damage, *journal[k + 1 :]]


@given(st.binary(max_size=300))
@settings(max_examples=FEW)
def test_what_is_no_journal_is_damage_only(data: bytes) -> None:
    found = read(data)
    assert [e.size for e in found if isinstance(e, Damage)] == ([len(data)] if data else [])
    assert len(found) == (1 if data else 0)


def test_a_length_that_is_a_lie_takes_no_memory() -> None:
    block = bytearray(rows_block(RowBlock((0.0, 0.0, 0.0), rows(0, 3))))
    block[5:9] = b"\xff\xff\xff\xff"
    assert read(bytes(block)) == [Damage(len(block), cut_short=False)]


DEEP = b"[" * 200_000
FORGED = {
    "no JSON": (b"H", b"{"),
    "nothing": (b"H", b"{}"),
    "a list": (b"H", b"[]"),
    "no text": (b"H", b"\xff\xfe"),
    "too deep": (b"H", DEEP),
    "no columns": (b"H", b'{"name": "a", "columns": [], "loop_hz": 1}'),
    "nested columns": (b"H", b'{"name": "a", "columns": [["t"]], "loop_hz": 1}'),
    "no rate": (b"H", b'{"name": "a", "columns": ["t"], "loop_hz": null}'),
    "not packed": (b"R", bytes(40)),
    "too short": (b"R", bytes(3)),
    "cut off": (b"R", bytes(24) + zlib.compress(rows(0, 9))[:-5]),
    "a part of a row": (b"R", bytes(24) + zlib.compress(rows(0, 1)[:-1])),
    "more than may be": (b"R", bytes(24) + zlib.compress(bytes(LARGEST + ROW.size))),
    "short clocks": (b"C", bytes(39)),
    "another version's": (b"X", b"?"),
}


@pytest.mark.parametrize("kind", FORGED)
@pytest.mark.parametrize("first", [True, False])
def test_a_block_that_no_recorder_writes_is_damage_though_its_checksum_is_right(
    kind: str, *, first: bool
) -> None:
    good: list[Entry] = []
    if not first:
        good += [HEADER, RowBlock((0.0, 0.0, 0.0), rows(0, 3))]
    start = struct.pack("<4scI", MARK, FORGED[kind][0], len(FORGED[kind][1]))
    check = zlib.crc32(FORGED[kind][1], zlib.crc32(start))
    block = start + struct.pack("<I", check) + FORGED[kind][1]
    more = RowBlock((0.0, 0.0, 0.0), rows(3, 5))
    found = read(b"".join([*map(encoded, good), block, encoded(more)]))
    assert found == [*good, Damage(len(block), cut_short=False), more]
    outline = Outline.of(found)
    assert outline.count == (2 if first else 5)
    assert not outline.intact


def test_a_file_of_nothing_but_promises_is_read_in_bounded_time() -> None:
    """A hundred thousand heads, each of which says that eight megabytes follow: once for ever."""
    head = struct.pack("<4scII", MARK, b"R", 2 * LARGEST, 0)
    lies = head * 100_000 + bytes(2 * LARGEST)
    assert read(lies) == [Damage(len(lies), cut_short=False)]
