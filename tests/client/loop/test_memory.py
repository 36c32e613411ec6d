from __future__ import annotations

import mmap
import os
import random
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cohaptic.protocol.patch import SIZE as PATCH_BYTES
from cohaptic.status.row import COLUMNS, Row, rows_in
from cohaptic_client.loop import memory as module
from cohaptic_client.loop.memory import COMMAND, RING_ROWS, SAMPLE, LoopMemory, RowRing, Slot
from tests.examples_of_laws import examples
from tests.small_disk import fill, small_disk

CAPACITY = 64
payloads = st.binary(max_size=CAPACITY)


@pytest.fixture
def memory() -> Iterator[LoopMemory]:
    made = LoopMemory.create()
    yield made
    made.close(remove=True)


def row(n: float) -> Row:
    return Row._make(float(n) for _ in COLUMNS)


def slot_memory() -> mmap.mmap:
    return mmap.mmap(-1, Slot.size(CAPACITY))


# Slot


@given(st.lists(payloads, min_size=1, max_size=10))
def test_a_read_gives_the_newest_value_once(values: list[bytes]) -> None:
    memory = slot_memory()
    writer, reader = Slot(memory, 0, CAPACITY), Slot(memory, 0, CAPACITY)
    assert reader.read() is None
    for value in values:
        writer.write(value)
    assert reader.read() == values[-1]
    assert reader.read() is None
    memory.close()


@given(st.lists(payloads, min_size=1, max_size=10))
def test_an_equal_value_is_a_new_one_too(values: list[bytes]) -> None:
    memory = slot_memory()
    writer, reader = Slot(memory, 0, CAPACITY), Slot(memory, 0, CAPACITY)
    for value in values:
        for _ in range(2):
            writer.write(value)
            assert reader.read() == value
    memory.close()


@given(
    st.lists(st.tuples(payloads, st.sets(st.integers(0, Slot.size(CAPACITY) - 1)))),
    st.booleans(),
)
def test_a_read_during_a_write_is_never_torn_and_never_old(
    writes: list[tuple[bytes, set[int]]], finish: bool
) -> None:
    """Any part of the bytes of a write may be there already when the other side looks."""
    whole, seen = slot_memory(), slot_memory()
    writer, reader = Slot(whole, 0, CAPACITY), Slot(seen, 0, CAPACITY)
    written, newest_read = list[bytes](), -1
    for number, (value, there) in enumerate(writes):
        # A number in front makes every value another one.
        written.append((number.to_bytes(2, "little") + value)[:CAPACITY])
        writer.write(written[-1])
        for at in there:
            seen[at] = whole[at]
        read = reader.read()
        if read is not None:
            assert written.index(read) > newest_read
            newest_read = written.index(read)
        if finish:
            seen[:] = whole[:]
            if newest_read < number:
                assert reader.read() == written[-1]
                newest_read = number
    whole.close()
    seen.close()


@given(payloads, payloads, st.integers(0, Slot.size(CAPACITY)))
def test_an_interrupted_write_loses_neither_the_reader_nor_the_next_value(
    first: bytes, second: bytes, cut: int
) -> None:
    whole, seen = slot_memory(), slot_memory()
    writer, reader = Slot(whole, 0, CAPACITY), Slot(seen, 0, CAPACITY)
    writer.write(first)
    seen[:] = whole[:]
    assert reader.read() == first
    writer.write(second)
    seen[:cut] = whole[:cut]
    assert reader.read() in (None, second)
    writer.write(first)
    seen[:] = whole[:]
    assert reader.read() == first
    whole.close()
    seen.close()


def test_rubbish_in_the_memory_is_no_value() -> None:
    """But for a checksum that is right by chance, once in four thousand million."""
    memory, rubbish = slot_memory(), random.Random(1)
    for _ in range(1000):
        memory[:] = rubbish.randbytes(len(memory))
        assert Slot(memory, 0, CAPACITY).read() is None
    memory.close()


WRITER = """
import sys
from cohaptic_client.loop.memory import LoopMemory
memory = LoopMemory(sys.argv[1])
n = 0
while memory.command.read() is None:
    n += 1
    memory.status.write(n.to_bytes(4, "little") * (1 + n % 200))
memory.close(remove=False)
"""


@pytest.mark.live
def test_a_reader_beside_a_writer_in_another_process_sees_whole_and_rising_values(
    memory: LoopMemory,
) -> None:
    with subprocess.Popen([sys.executable, "-c", WRITER, memory.path]) as writer:
        try:
            last, reads = 0, 0
            while reads < 2000:
                value = memory.status.read()
                if value is None:
                    assert reads or writer.poll() is None
                    continue
                n = int.from_bytes(value[:4], "little")
                assert value == n.to_bytes(4, "little") * (1 + n % 200)
                assert n > last
                last, reads = n, reads + 1
        finally:
            memory.command.write(b"enough")
    assert writer.returncode == 0


# Ring


@given(st.lists(st.integers(0, RING_ROWS - 64), max_size=5))
@settings(max_examples=examples(8), deadline=None)
def test_a_reader_that_keeps_up_gets_every_row_in_order(batches: list[int]) -> None:
    memory = mmap.mmap(-1, RowRing.size())
    writer, reader = RowRing(memory, 0), RowRing(memory, 0)
    count = 0
    for batch in batches:
        for n in range(count, count + batch):
            writer.append(row(n))
        assert rows_in(reader.read_new()) == [row(n) for n in range(count, count + batch)]
        count += batch
    assert reader.read_new() == b""
    memory.close()


@given(st.integers(0, 500), st.integers(RING_ROWS - 100, 2 * RING_ROWS + 100))
@settings(max_examples=examples(5), deadline=None)
def test_a_slow_reader_loses_only_the_oldest(before: int, after: int) -> None:
    memory = mmap.mmap(-1, RowRing.size())
    writer, reader = RowRing(memory, 0), RowRing(memory, 0)
    for n in range(before):
        writer.append(row(n))
    reader.read_new()
    for n in range(before, before + after):
        writer.append(row(n))
    kept = min(after, RING_ROWS - 64)
    end = before + after
    assert rows_in(reader.read_new()) == [row(n) for n in range(end - kept, end)]
    memory.close()


# Memory


def test_what_one_side_writes_the_other_reads_each_in_its_place(memory: LoopMemory) -> None:
    other = LoopMemory(memory.path)
    values = {
        "patch": bytes(range(PATCH_BYTES)),
        "sample": b"s" * SAMPLE.size,
        "command": b"c" * COMMAND.size,
        "status": b"{" * 1024,
    }
    for name, value in values.items():
        getattr(memory, name).write(value)
    memory.rows.append(row(7.5))
    assert {name: getattr(other, name).read() for name in values} == values
    assert rows_in(other.rows.read_new()) == [row(7.5)]
    other.close(remove=False)


def test_the_file_lives_until_its_maker_removes_it() -> None:
    made = LoopMemory.create()
    other = LoopMemory(made.path)
    other.close(remove=False)
    assert os.path.exists(made.path)
    made.close(remove=True)
    assert not os.path.exists(made.path)


def test_nobody_else_may_read_the_file(memory: LoopMemory) -> None:
    if sys.platform != "win32":
        assert os.stat(memory.path).st_mode & 0o077 == 0


@pytest.mark.live
@pytest.mark.parametrize("size", ["64k", "4k"])
def test_where_shared_memory_is_full_the_file_is_elsewhere_and_every_byte_of_it_is_there(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, size: str
) -> None:
    """A write into a page that a full folder cannot give ends a process by SIGBUS."""
    with small_disk(tmp_path / "shm", size) as folder:
        monkeypatch.setattr(module, "_IN_MEMORY", str(folder))
        fill(folder)
        made = LoopMemory.create()
        assert not made.path.startswith(str(folder))
        assert [path.name for path in folder.iterdir()] == ["filling"]
        status = os.stat(made.path)
        assert status.st_blocks * 512 >= status.st_size
        for n in range(2 * RING_ROWS):
            made.rows.append(row(n))
        made.close(remove=True)
