"""Laws of a session file: what is written is read, whatever becomes of the file."""

from __future__ import annotations

import itertools
import os
import random
import re
import shutil
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cohaptic.errors import SettingError
from cohaptic.sessions.entries import (
    Damage,
    Entry,
    Happened,
    Mark,
    Rows,
    SessionInfo,
    Ticked,
    Written,
)
from cohaptic.sessions.reader import Outline, read_entries
from cohaptic.sessions.writer import SessionFile
from tests.examples_of_laws import examples
from tests.shared.sessions.made import T, in_order, info, rows, session, write, written


def without_damage(path: Path) -> list[Entry]:
    return [entry for entry in read_entries(path) if not isinstance(entry, Damage)]


def cut(path: Path, size: int) -> Path:
    """A copy with so many bytes."""
    shutil.copy(path, path.with_name("cut.mcap"))
    os.truncate(path.with_name("cut.mcap"), size)
    return path.with_name("cut.mcap")


def chunks_in(data: bytes | bytearray) -> list[int]:
    """Where the name of the compression stands in each chunk."""
    return [found.start() for found in re.finditer(b"zstd", data)]


@given(st.lists(written, max_size=12), st.booleans())
@settings(max_examples=examples(100))
def test_what_is_written_is_read_in_the_order_of_the_times(
    tmp_path_factory: pytest.TempPathFactory, entries: list[Written], plots: bool
) -> None:
    path = write(tmp_path_factory.mktemp("law") / "x.mcap", entries, plots=plots)
    assert list(read_entries(path)) == in_order([info(), *entries])
    outline = Outline.of(path)
    assert outline.complete
    assert outline.info == info()
    assert sum(outline.counts.values()) == len(entries) + 1
    assert list(outline.marks) == [e for e in in_order(entries) if isinstance(e, Mark)]


@given(st.lists(written, max_size=12))
@settings(max_examples=examples(40))
def test_two_runs_give_the_same_bytes(
    tmp_path_factory: pytest.TempPathFactory, entries: list[Written]
) -> None:
    folder = tmp_path_factory.mktemp("law")
    one, other = write(folder / "1.mcap", entries), write(folder / "2.mcap", entries)
    assert one.read_bytes() == other.read_bytes()


@given(
    st.lists(written, max_size=12),
    st.floats(T - 3.0, T + 9.0) | st.none(),
    st.floats(T - 3.0, T + 9.0) | st.none(),
    st.booleans(),
)
@settings(max_examples=examples(100))
def test_a_part_by_time_is_the_same_part_of_the_whole(
    tmp_path_factory: pytest.TempPathFactory,
    entries: list[Written],
    start: float | None,
    end: float | None,
    closed: bool,
) -> None:
    path = write(tmp_path_factory.mktemp("law") / "x.mcap", entries)
    if not closed:
        path = cut(path, path.stat().st_size - 9)  # without an index that can be found
    expected: list[Entry] = [
        entry
        for entry in in_order([info(), *entries])
        if (start is None or entry.t >= start) and (end is None or entry.t < end)
    ]
    if not closed and end is None:
        expected.append(Damage(Outline.of(path).last, cut_short=True))
    assert list(read_entries(path, start, end)) == expected


@pytest.mark.parametrize("bound", [float("inf"), float("-inf"), float("nan"), 1e300])
def test_any_bound_may_be_asked_for(tmp_path: Path, bound: float) -> None:
    path, whole = write(tmp_path / "x.mcap", session(0.5)), in_order([info(), *session(0.5)])
    assert list(read_entries(path, bound)) == [e for e in whole if e.t >= bound]
    assert list(read_entries(path, None, bound)) == [e for e in whole if e.t < bound]


def test_a_file_cut_at_any_byte_gives_a_prefix_or_the_named_error(tmp_path: Path) -> None:
    """At all of the first bytes, of the last, and at some of each kind of record between."""
    entries = session(2.2, users=1)
    path = write(tmp_path / "x.mcap", entries)
    size = path.stat().st_size
    chosen = {*range(60), *range(size - 60, size), *random.Random(1).sample(range(size), 150)}
    lengths = list[int]()
    all_written = [info(), *entries]
    for at in sorted(chosen):
        short = cut(path, at)
        try:
            found = without_damage(short)
        except SettingError:
            with pytest.raises(SettingError, match=r"cut\.mcap"):
                Outline.of(short)
            lengths.append(0)
            continue
        lengths.append(len(found))
        assert found == in_order(all_written[: len(found)])
        outline = Outline.of(short)
        assert not outline.complete
        assert sum(outline.counts.values()) == len(found)
    assert lengths == sorted(lengths)
    assert lengths[0] == 0
    assert lengths[-1] == len(all_written)
    assert len(set(lengths)) > 4  # chunks, and the part of a chunk that was cut


def test_of_a_cut_chunk_the_entries_before_the_cut_are_read_and_the_cut_is_told(
    tmp_path: Path,
) -> None:
    noise = random.Random(1)
    entries = [Happened(T, "x", None, noise.randbytes(150).hex()) for _ in range(5_000)]
    path = write(tmp_path / "x.mcap", entries)
    short = cut(path, path.stat().st_size * 3 // 4)
    found = list(read_entries(short))
    assert isinstance(found[-1], Damage)
    assert found[-1].cut_short
    assert 500 < len(found) < 5_000
    assert found[:-1] == [info(), *entries][: len(found) - 1]


def test_a_killed_process_loses_a_second_at_most(tmp_path: Path) -> None:
    file = SessionFile("--record", tmp_path / "x.mcap", info())
    for i in range(10_000):
        file.add(Ticked(T + i / 1000.0, i))
        if i % 50 == 0:
            file.add(rows(T + i / 1000.0 - 0.4, 50))  # late, as from a slow link
        if i % 337 == 0:
            found = [e.t for e in read_entries(tmp_path / "x.mcap") if isinstance(e, Ticked)]
            assert len(found) >= i - 1000
            assert found == [T + k / 1000.0 for k in range(len(found))]
    file.close()


def test_one_wrong_time_ends_a_chunk_and_keeps_none_open(tmp_path: Path) -> None:
    file = SessionFile("--record", tmp_path / "x.mcap", info())
    for t in [T, T + 1e6, T + 0.1, T + 1.2, T + 1.3]:
        file.add(Ticked(t, 1))
    found = [e.t for e in read_entries(tmp_path / "x.mcap") if isinstance(e, Ticked)]
    assert found == [T, T + 0.1, T + 1.2, T + 1e6]
    file.close()


def test_a_damaged_chunk_is_told_and_the_others_are_read(tmp_path: Path) -> None:
    entries = [Ticked(T + i / 10, i) for i in range(100)]
    path = write(tmp_path / "x.mcap", entries)
    data = bytearray(path.read_bytes())
    places = chunks_in(data)
    data[places[4] + 40] ^= 0xFF
    path.write_bytes(data)
    found = list(read_entries(path))
    ticks = [e.tick for e in found if isinstance(e, Ticked)]
    missing = sorted(set(range(100)) - set(ticks))
    assert missing == list(range(missing[0], missing[0] + 6))
    [gap] = [e for e in found if isinstance(e, Damage)]
    assert gap == Damage(pytest.approx(T + missing[0] / 10), False)  # type: ignore[arg-type]
    assert [e.t for e in found] == sorted(e.t for e in found)


def test_nothing_is_overwritten(tmp_path: Path) -> None:
    path = tmp_path / "x.mcap"
    path.write_bytes(b"somebody's")
    with pytest.raises(SettingError, match=r"--record is .*x\.mcap; it must be the name of a file"):
        SessionFile("--record", path, info())
    (tmp_path / "link.mcap").symlink_to(path)
    with pytest.raises(SettingError, match="does not exist yet"):
        SessionFile("--record", tmp_path / "link.mcap", info())
    assert path.read_bytes() == b"somebody's"


def test_a_session_that_cannot_be_written_leaves_no_file(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="to_wall of a session is nan"):
        SessionFile("--record", tmp_path / "x.mcap", info(to_wall=float("nan")))
    with pytest.raises(SettingError, match="No such file or directory"):
        SessionFile("--record", tmp_path / "no folder" / "x.mcap", info())
    assert list(tmp_path.iterdir()) == []


def test_the_outline_of_a_session_is_the_same_with_and_without_an_index(tmp_path: Path) -> None:
    path = write(tmp_path / "x.mcap", session())
    outline = Outline.of(path)
    assert outline.users == {1: "u1", 2: "u2"}
    assert outline.seconds == pytest.approx(3.0, abs=1e-6)
    assert [mark.text for mark in outline.marks] == ["trial 1", "pause"]
    assert (outline.rows_lost, outline.left_out, outline.damaged) == ({2: 17}, 3, 0)
    assert outline.counts["Heard"] == 60
    assert outline.counts["Patched"] == 120
    again = Outline.of(cut(path, path.stat().st_size - 1))
    assert not again.complete
    assert (again.users, again.marks, again.counts, again.rows_lost, again.left_out) == (
        outline.users, outline.marks, outline.counts, outline.rows_lost, outline.left_out,
    )  # fmt: skip


def test_a_part_of_a_long_session_is_read_without_the_rest(tmp_path: Path) -> None:
    """Of 400 chunks those of the asked second are read, and the first, with the channels."""
    path = write(tmp_path / "x.mcap", [Ticked(T + i / 20, i) for i in range(4_000)])
    data = bytearray(path.read_bytes())
    places = chunks_in(data)
    for place in places[2:180] + places[220:400]:
        data[place + 40] ^= 0xFF  # who reads it notices
    path.write_bytes(data)
    for file in (path, cut(path, len(data) - 1)):
        found = list(read_entries(file, T + 100.0, T + 101.0))
        assert found == [Ticked(T + i / 20, i) for i in range(2_000, 2_020)]


def test_a_time_far_from_the_epoch_is_kept(tmp_path: Path) -> None:
    for i, (t, to_wall) in enumerate(itertools.product((-5.0, 1e8 + 1 / 3), (0.0, 1.8e9))):
        file = SessionFile("--record", tmp_path / f"{i}.mcap", info(t, to_wall))
        file.add(rows(t, 3))
        file.close()
        found = list(read_entries(tmp_path / f"{i}.mcap"))
        assert isinstance(found[0], SessionInfo)
        assert isinstance(found[1], Rows)
        assert [entry.t for entry in found] == [t, t]
