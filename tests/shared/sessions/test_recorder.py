from __future__ import annotations

import os
import threading
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from cohaptic.errors import OutputError, SettingError
from cohaptic.recording.part import Part
from cohaptic.sessions.entries import Happened, LeftOut, Mark, SessionInfo, Ticked, Written
from cohaptic.sessions.reader import Outline, read_entries
from cohaptic.sessions.recorder import SessionRecorder, open_recorder
from tests.client.devices.until import until
from tests.give_up import give_up
from tests.patience import PATIENCE
from tests.shared.sessions.made import T, in_order, info, rows, session
from tests.small_disk import fill, small_disk


def recorder(path: Path, told: list[str] | None = None, waiting: int = 2**26) -> SessionRecorder:
    heard: list[str] = [] if told is None else told
    return SessionRecorder(path, info(), tell=heard.append, waiting=waiting)


def wait_for_its_end(made: SessionRecorder) -> None:
    made._thread.join(PATIENCE)  # pyright: ignore[reportPrivateUsage]
    assert made.ended


def ticks(path: Path) -> list[int]:
    return [entry.tick for entry in read_entries(path) if isinstance(entry, Ticked)]


def test_a_recorder_writes_what_it_is_given_and_says_where(tmp_path: Path) -> None:
    made = recorder(tmp_path / "x.mcap")
    entries = session(1.0)
    for entry in entries:
        made.add(entry)
    assert made.finish() == f"recorded to {tmp_path / 'x.mcap'}"
    assert list(read_entries(tmp_path / "x.mcap")) == in_order([info(), *entries])
    assert list(tmp_path.iterdir()) == [tmp_path / "x.mcap"]
    made.add(Ticked(T, 1))  # after the end, as a late message of a client: nothing


def test_a_room_at_rest_leaves_no_chunk_open(tmp_path: Path) -> None:
    made = recorder(tmp_path / "x.mcap")
    made.add(Ticked(T, 1))
    until(lambda: ticks(tmp_path / "x.mcap") == [1])
    made.finish()


def test_what_does_not_fit_is_counted_and_told_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    told, made = held(tmp_path, monkeypatch, waiting=10_000)
    for i in range(50):
        made.add(Ticked(T + i, i))
    release(made)
    until(lambda: not made._waiting)  # pyright: ignore[reportPrivateUsage]
    made.add(Mark(T + 100.0, "there is room again", {}))
    assert f"{made.left_out} entries are left out" in made.finish()
    found = list(read_entries(tmp_path / "x.mcap"))
    [lost] = [entry for entry in found if isinstance(entry, LeftOut)]
    assert len(ticks(tmp_path / "x.mcap")) + lost.count == 50
    assert lost.count == made.left_out > 30
    assert Outline.of(tmp_path / "x.mcap").left_out == lost.count
    assert len(told) == 1
    assert "the disk is too slow" in told[0]


def test_what_does_not_fit_until_the_end_is_counted_too(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    _, made = held(tmp_path, monkeypatch, waiting=10_000)
    for i in range(50):
        made.add(Ticked(T + i, i))
    release(made)
    made.finish()
    outline = Outline.of(tmp_path / "x.mcap")
    assert outline.counts["Ticked"] + outline.left_out == 50
    assert outline.left_out > 30


gates: dict[int, threading.Event] = {}


def held(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, waiting: int
) -> tuple[list[str], SessionRecorder]:
    """A recorder whose disk takes nothing until it is released."""
    told: list[str] = []
    made = recorder(tmp_path / "x.mcap", told, waiting)
    gate = gates[id(made)] = threading.Event()
    file = made._file  # pyright: ignore[reportPrivateUsage]
    add: Callable[[Written], None] = file.add

    def slow(entry: Written) -> None:
        gate.wait(PATIENCE)
        add(entry)

    monkeypatch.setattr(file, "add", slow)
    return told, made


def release(made: SessionRecorder) -> None:
    gates.pop(id(made)).set()


def test_an_entry_that_no_file_can_hold_costs_only_itself(tmp_path: Path) -> None:
    told: list[str] = []
    made = recorder(tmp_path / "x.mcap", told)
    wrong: list[Any] = [Ticked(float("nan"), 1), Ticked(T, -1), Mark("x", "", {}), rows(T, 1, -5)]  # type: ignore[arg-type]
    for entry in (Ticked(T, 1), *wrong, Ticked(T, 2)):
        made.add(entry)
    assert made.finish().endswith("4 entries are left out")
    assert ticks(tmp_path / "x.mcap") == [1, 2]
    assert Outline.of(tmp_path / "x.mcap").left_out == 4
    assert len(told) == 1
    assert "lacks an entry of kind Ticked: t of an entry is nan" in told[0]


def test_an_existing_name_is_refused_before_anything_begins(tmp_path: Path) -> None:
    (tmp_path / "x.mcap").write_bytes(b"somebody's")
    before = threading.active_count()
    with pytest.raises(SettingError, match=r"--record is .*does not exist yet"):
        recorder(tmp_path / "x.mcap")
    assert (tmp_path / "x.mcap").read_bytes() == b"somebody's"
    assert threading.active_count() == before


def test_two_recorders_do_not_meet_on_one_name_and_the_file_is_locked(tmp_path: Path) -> None:
    made = recorder(tmp_path / "x.mcap")
    with pytest.raises(SettingError, match="does not exist yet"):
        recorder(tmp_path / "x.mcap")
    with pytest.raises(OutputError, match="a program is still recording to it"):
        Part.left(tmp_path / "x.mcap")
    made.finish()
    Part.left(tmp_path / "x.mcap").close()


def test_a_folder_that_nobody_may_write_to_is_named(tmp_path: Path) -> None:
    """The superuser may write everywhere but where a file system itself takes nothing."""
    folder = Path("/proc") if os.geteuid() == 0 else tmp_path
    if folder == tmp_path:
        folder.chmod(0o500)
    elif not folder.is_dir():
        give_up("there is no /proc")
    with pytest.raises(SettingError, match=r"--record is .*x\.mcap; it must be a file that can be"):
        recorder(folder / "x.mcap")


@pytest.mark.parametrize("whole_folder", [False, True])
def test_a_file_that_was_removed_is_told_at_once_and_kept_elsewhere(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, whole_folder: bool
) -> None:
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    told: list[str] = []
    folder = tmp_path / "folder"
    folder.mkdir()
    made = recorder(folder / "x.mcap", told)
    made.add(Ticked(T, 1))
    until(lambda: ticks(folder / "x.mcap") == [1])
    (folder / "x.mcap").unlink()
    if whole_folder:
        folder.rmdir()
    made.add(Ticked(T + 2.0, 2))
    made.add(Ticked(T + 4.0, 3))
    wait_for_its_end(made)
    made.add(Ticked(T + 6.0, 4))  # the session goes on
    assert len(told) == 1
    assert "x.mcap ends here (somebody has removed or moved it or its folder)" in told[0]
    with pytest.raises(OutputError, match="the recording ended before the session") as ended:
        made.finish()
    [kept] = tmp_path.glob("x-*.mcap")
    assert str(kept) in str(ended.value)
    assert ticks(kept)[0] == 1


def test_a_file_that_was_removed_just_before_the_end_is_kept_elsewhere(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    folder = tmp_path / "folder"
    folder.mkdir()
    made = recorder(folder / "x.mcap")
    made.add(Ticked(T, 1))
    until(lambda: ticks(folder / "x.mcap") == [1])
    (folder / "x.mcap").unlink()
    with pytest.raises(OutputError, match="what there is is kept in"):
        made.finish()
    [kept] = tmp_path.glob("x-*.mcap")
    assert ticks(kept) == [1]


@pytest.mark.live
@pytest.mark.parametrize("room", [0, 4, 16, 32, 64, 128, 256])
def test_a_full_disk_ends_the_recording_and_keeps_what_fitted(tmp_path: Path, room: int) -> None:
    """At seven places, the room that is left for the recording in kB."""
    told: list[str] = []
    with small_disk(tmp_path / "disk", "1m") as disk:
        filling = fill(disk)
        os.truncate(filling, filling.stat().st_size - 1024 * room)
        path = disk / "x.mcap"
        if room == 0:  # four kilobytes hold the first entry and the channels
            with pytest.raises((OutputError, SettingError), match="No space left on device"):
                recorder(path, told)
            assert not path.exists()
            return
        made = recorder(path, told)
        words = [os.urandom(600).hex() for _ in range(4_000)]
        for i, word in enumerate(words):
            made.add(Happened(T + i / 100.0, "noise", None, word))
        wait_for_its_end(made)
        made.add(Happened(T, "noise", None, "after the end"))
        with pytest.raises(OutputError, match="No space left on device"):
            made.finish()
        assert len(told) == 1
        assert "x.mcap ends here (No space left on device), and the session goes on" in told[0]
        first, *found = list(read_entries(path))
        assert isinstance(first, SessionInfo)
        texts = [entry.text for entry in found if isinstance(entry, Happened)]
        assert texts == words[: len(texts)]
        if room >= 256:
            assert len(texts) >= 100
        filling.unlink()


@pytest.mark.parametrize("room", ["../evil", "/tmp/evil", "a/b", "..", "", "x" * 300, "a\0b"])
def test_the_name_of_a_room_leads_out_of_no_folder(room: str, tmp_path: Path) -> None:
    folder = tmp_path / "mine"
    made = open_recorder(str(folder), replace(info(), room=room), lambda words: None)
    made.finish()
    assert [path.parent for path in folder.iterdir()] == [folder]
    assert list(tmp_path.iterdir()) == [folder]
    assert made.path.name.startswith("room-")


def test_a_disk_that_never_answers_keeps_nobody_waiting(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("cohaptic.sessions.recorder._PATIENCE", 0.05)
    _, made = held(tmp_path, monkeypatch, waiting=10_000)
    made.add(Ticked(T, 1))
    with pytest.raises(OutputError, match=r"has not answered for 0\.05 s"):
        made.finish()
    release(made)
