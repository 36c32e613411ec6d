from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cohaptic.errors import OutputError, SettingError
from cohaptic.recording.archive import finish, read_outline, read_recording
from cohaptic.recording.journal import Clocks, RowBlock, rows_block
from cohaptic.recording.part import Part, part_of
from cohaptic.recording.recorder import WAITING
from cohaptic.status.row import COLUMNS, Row
from cohaptic.vec import ZERO
from tests.client.devices.until import until
from tests.examples_of_laws import examples
from tests.patience import PATIENCE
from tests.shared.recording.rows import recorder, row, rows
from tests.small_disk import fill, small_disk


def test_a_file_holds_every_row_in_order_and_says_whose_it_is_and_when(tmp_path: Path) -> None:
    made = recorder(tmp_path / "a b.npz")
    made.note(Clocks(0.0, 0.0))  # before the first row: nothing
    made.keep(rows(1, 3), (12.0, 0.0, -0.5))
    made.note(Clocks(100.002, -12.5, 7.0, 0.001, 3.0))
    made.keep(b"")
    made.keep(rows(3, 4))
    made.note(Clocks(100.003, -5.0))
    assert made.finish() == f"recorded to {tmp_path / 'a b.npz'}: 0.0 s, without a gap"
    with np.load(tmp_path / "a b.npz") as file:
        assert tuple(file["columns"]) == COLUMNS
        assert [Row._make(values) for values in file["rows"]] == [row(n) for n in (1, 2, 3)]
        assert str(file["name"]) == "ann"
        assert float(file["loop_hz"]) == 1000.0
        assert file["origin"].tolist() == [[12.0, 0.0, -0.5]] * 2 + [[0.0, 0.0, 0.0]]
        assert (float(file["to_wall_begin"]), float(file["to_wall"])) == (-12.5, -5.0)
        assert file["clock_columns"].tolist() == list(Clocks._fields)
        assert file["clocks"][0].tolist() == [100.002, -12.5, 7.0, 0.001, 3.0]
        assert file["gaps"].shape == (0, 2)
    assert list(tmp_path.iterdir()) == [tmp_path / "a b.npz"]


@given(st.lists(st.integers(0, 40), min_size=1, max_size=6))
@settings(max_examples=examples(20))
def test_a_part_and_its_archive_are_the_same_recording(
    tmp_path_factory: pytest.TempPathFactory, counts: list[int]
) -> None:
    path = tmp_path_factory.mktemp("law") / "x.npz"
    made, start = recorder(path), 0
    for count in [1, *counts]:
        made.keep(rows(start, start + count), (float(start), 0.0, 0.0))
        start += count + 20  # a gap after each block
    made.note(Clocks(0.0, 4.0))
    made.finish()
    whole = read_recording(path)
    assert len(whole.rows) == sum([1, *counts])
    assert len(whole.outline.gaps) == sum(count > 0 for count in counts)
    assert whole.to_wall == 4.0
    assert (
        whole.origin[:, 0].tolist()
        == np.unique(whole.origin[:, 0]).repeat([count for count in [1, *counts] if count]).tolist()
    )


def test_a_file_that_appeared_meanwhile_is_not_replaced(tmp_path: Path) -> None:
    path = tmp_path / "x.npz"
    made = recorder(path)
    made.keep(rows(0, 5))
    path.write_bytes(b"somebody's")
    with pytest.raises(OutputError, match=r"appeared meanwhile.*--finish .*x\.npz\.part"):
        made.finish()
    assert path.read_bytes() == b"somebody's"
    path.rename(tmp_path / "theirs.npz")
    finish(Part.left(part_of(path)), path, overwrite=False)
    assert len(read_recording(path).rows) == 5
    assert sorted(p.name for p in tmp_path.iterdir()) == ["theirs.npz", "x.npz"]


def test_an_older_file_is_there_until_the_new_one_takes_its_place(tmp_path: Path) -> None:
    path = tmp_path / "x.npz"
    path.write_bytes(b"an earlier one")
    made = recorder(path, overwrite=True)
    made.keep(rows(0, 5))
    assert path.read_bytes() == b"an earlier one"
    made.finish()
    assert len(read_recording(path).rows) == 5


def test_two_recorders_do_not_meet_on_one_name(tmp_path: Path) -> None:
    made = recorder(tmp_path / "x.npz")
    (tmp_path / "link.npz").symlink_to(tmp_path / "x.npz")
    for name in ("x.npz", "link.npz"):
        for overwrite in (False, True):
            with pytest.raises(SettingError, match="no other program is recording"):
                recorder(tmp_path / name, overwrite=overwrite)
    made.keep(rows(0, 5))
    with pytest.raises(OutputError, match="a program is still recording to it"):
        Part.left(tmp_path / "x.npz.part")
    made.finish()


def test_what_a_killed_process_has_left_is_never_replaced(tmp_path: Path) -> None:
    part = tmp_path / "x.npz.part"
    part.write_bytes(b"rows")
    for overwrite in (False, True):
        with pytest.raises(SettingError, match=r"cohaptic recording --finish .*x\.npz\.part"):
            recorder(tmp_path / "x.npz", overwrite=overwrite)
    assert part.read_bytes() == b"rows"
    part.write_bytes(b"")  # it had no row yet: that is nobody's data
    made = recorder(tmp_path / "x.npz")
    made.keep(rows(0, 1))
    made.finish()


def test_of_a_damaged_part_the_rest_is_saved_and_the_part_stays(tmp_path: Path) -> None:
    path, part = tmp_path / "x.npz", tmp_path / "x.npz.part"
    made = recorder(path)
    for start in range(0, 50, 10):
        made.keep(rows(start, start + 10))
    path.touch()
    with pytest.raises(OutputError):
        made.finish()
    path.unlink()
    data = bytearray(part.read_bytes())
    data[len(data) // 2] ^= 1
    part.write_bytes(data)
    outline = finish(Part.left(part), path, overwrite=False)
    assert (outline.count, outline.intact) == (40, False)
    assert len(read_recording(path).rows) == 40
    assert part.read_bytes() == data


def test_a_folder_that_was_removed_is_told_at_once_and_costs_no_row(tmp_path: Path) -> None:
    reported: list[str] = []
    folder = tmp_path / "folder"
    folder.mkdir()
    made = recorder(folder / "x.npz", reported)
    (folder / "x.npz.part").unlink()
    folder.rmdir()
    made.keep(rows(0, 10))
    made._thread.join()  # pyright: ignore[reportPrivateUsage]
    made.keep(rows(10, 20))
    assert len(reported) == 1
    assert "x.npz ends here (somebody has removed or moved it or its folder)" in reported[0]
    with pytest.raises(OutputError, match=r"0\.0 s, without a gap, are kept in") as ended:
        made.finish()
    rescued = Path(reported[0].rpartition(" ")[2])
    assert str(rescued) in str(ended.value)
    assert len(read_recording(rescued).rows) == 10
    rescued.unlink()


def test_what_the_disk_cannot_take_is_a_gap(tmp_path: Path) -> None:
    reported: list[str] = []
    made = recorder(tmp_path / "x.npz", reported)
    block = rows(0, 1000)
    made._changed.acquire()  # pyright: ignore[reportPrivateUsage]
    for _ in range(WAITING // len(block) + 2):
        made.keep(block)
    made._changed.release()  # pyright: ignore[reportPrivateUsage]
    assert reported == [
        f"the disk is too slow for the recording {tmp_path}/x.npz: it will have a gap"
    ]
    made.finish()
    assert len(read_recording(tmp_path / "x.npz").rows) == WAITING // len(block) * 1000


def test_nothing_in_the_way_of_a_part_is_followed(tmp_path: Path) -> None:
    (tmp_path / "theirs").write_bytes(b"")
    (tmp_path / "x.npz.part").symlink_to(tmp_path / "theirs")
    with pytest.raises(SettingError):
        recorder(tmp_path / "x.npz")
    os.mkfifo(tmp_path / "y.npz.part")
    with pytest.raises(SettingError):
        recorder(tmp_path / "y.npz")


@pytest.mark.parametrize("content", [b"", b"PK", b"\x93NUMPY", b"text"])
def test_a_file_that_is_no_recording_is_a_sentence(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "x").write_bytes(content)
    if content:
        with pytest.raises(SettingError, match="cohaptic touch --record"):
            read_recording(tmp_path / "x")
    else:
        assert len(read_recording(tmp_path / "x").rows) == 0


def test_a_recording_of_an_earlier_version_can_be_read(tmp_path: Path) -> None:
    table = np.frombuffer(rows(0, 30)).reshape(-1, len(COLUMNS))
    np.savez_compressed(
        tmp_path / "x.npz", columns=np.array(COLUMNS), rows=table, name="bob", to_wall=2.0,
        origin=np.zeros((30, 3)),
    )  # fmt: skip
    found = read_recording(tmp_path / "x.npz")
    assert (found.outline.header.name, found.outline.count, found.to_wall) == ("bob", 30, 2.0)


@pytest.mark.live
@pytest.mark.parametrize("room", [0, 4, 8, 16, 24, 32, 48, 64, 96, 128])
def test_a_full_disk_costs_what_did_not_fit_and_no_older_file(tmp_path: Path, room: int) -> None:
    """At ten places, the room that is left for the recording in kB."""
    reported: list[str] = []
    with small_disk(tmp_path / "disk", "512k") as disk:
        path = disk / "x.npz"
        path.write_bytes(b"an earlier one")
        filling = fill(disk)
        os.truncate(filling, filling.stat().st_size - 1024 * room)
        made, noise = recorder(path, reported, overwrite=True), np.random.default_rng(1)
        kept = largest = 0
        for start in range(0, 2000, 100):
            block = np.frombuffer(rows(start, start + 100)).reshape(-1, len(COLUMNS)).copy()
            block[:, 1:6] += noise.random((100, 5))  # so that it does not become small
            made.keep(block.tobytes())
            kept += 100
            largest = max(largest, len(rows_block(RowBlock(ZERO, block.tobytes()))))
        made._thread.join()  # pyright: ignore[reportPrivateUsage]
        assert len(reported) == 1
        assert "No space left on device" in reported[0]
        with pytest.raises(OutputError, match=r"the recording ended before the hand did"):
            made.finish()
        found = read_recording(part_of(path))
        # All blocks that fit, each of 100 rows; a page may be there in part.
        assert 100 * (1024 * (room - 4) // largest) <= len(found.rows) < kept
        assert found.rows[:, 0] == pytest.approx([row(n).t for n in range(len(found.rows))])
        assert path.read_bytes() == b"an earlier one"
        filling.unlink()
        if len(found.rows):
            finish(Part.left(part_of(path)), path, overwrite=True)
            assert len(read_recording(path).rows) == len(found.rows)


def until_written(path: Path, count: int) -> None:
    until(lambda: read_outline(part_of(path)).count == count, PATIENCE)


@pytest.mark.parametrize("error", [MemoryError(), ValueError("no such row"), OSError(5, "I/O")])
def test_whatever_ends_the_writing_is_said_at_once_and_what_there_is_is_kept(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, error: Exception
) -> None:
    reported: list[str] = []
    made = recorder(tmp_path / "x.npz", reported)
    made.keep(rows(0, 3))
    until_written(tmp_path / "x.npz", 3)

    def fail(block: RowBlock) -> bytes:
        raise error

    monkeypatch.setattr("cohaptic.recording.recorder.rows_block", fail)
    made.keep(rows(3, 9))
    with pytest.raises(OutputError, match="the recording ended before the hand did"):
        made.finish()
    (words,) = reported
    assert "ends here" in words
    assert len(read_recording(part_of(tmp_path / "x.npz")).rows) == 3


def test_rows_that_another_program_has_destroyed_are_said(tmp_path: Path) -> None:
    made = recorder(tmp_path / "x.npz")
    for start in (0, 10, 20):
        made.keep(rows(start, start + 10))
        until_written(tmp_path / "x.npz", start + 10)
    part = part_of(tmp_path / "x.npz")
    with part.open("r+b") as file:
        file.seek(part.stat().st_size - 30)
        file.write(b"????")
    with pytest.raises(OutputError, match="10 of 30 rows are lost: another program has changed"):
        made.finish()
    assert len(read_recording(tmp_path / "x.npz").rows) == 20
    assert part.exists()
