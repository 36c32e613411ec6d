from __future__ import annotations

import contextlib
import logging
import os
import shutil
import stat
import subprocess
import sys
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from cohaptic.clock import SystemClock
from cohaptic.errors import SettingError
from cohaptic_server.access.remembered import Record, Used
from cohaptic_server.credentials import journal as module
from cohaptic_server.credentials.journal import MAX_WAITING, Journal
from tests.patience import PATIENCE

pytestmark = pytest.mark.live

CLOCK = SystemClock()


def used(i: int, life: float = 100.0) -> Used:
    return Used(jti=f"token-{i}", ends=CLOCK.now() + CLOCK.to_wall() + life)


def kept(folder: Path, *records: Record) -> list[Record]:
    """What a journal finds at its start, which then keeps more."""
    journal = Journal(folder, "main")
    found = journal.open()
    for record in records:
        journal.keep(record)
    journal.close()
    return found


def until(condition: Callable[[], bool]) -> None:
    deadline = CLOCK.now() + PATIENCE
    while not condition():
        assert CLOCK.now() < deadline
        threading.Event().wait(0.01)


def test_what_one_keeps_the_next_finds_and_what_has_ended_is_forgotten(tmp_path: Path) -> None:
    folder = tmp_path / "new" / "state"
    assert kept(folder, used(1), used(2, life=-1.0)) == []
    (found,) = kept(folder, one := used(3))
    assert found == used(1).model_copy(update={"ends": getattr(found, "ends")})  # noqa: B009
    assert kept(folder) == [found, one]


def test_rooms_keep_apart(tmp_path: Path) -> None:
    kept(tmp_path, used(1))
    other = Journal(tmp_path, "other")
    assert other.open() == []
    other.close()


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no modes")
def test_nobody_else_may_read_it(tmp_path: Path) -> None:
    kept(tmp_path / "state", used(1))
    for path in (tmp_path / "state", *(tmp_path / "state").iterdir()):
        assert stat.S_IMODE(path.stat().st_mode) & 0o077 == 0


def test_what_was_cut_or_is_rubbish_costs_no_other_line(tmp_path: Path) -> None:
    kept(tmp_path, used(1), used(2))
    (path,) = tmp_path.iterdir()
    lines = path.read_bytes().splitlines(keepends=True)
    path.write_bytes(lines[0] + b"\xff rubbish \x00\n{}\n" + lines[1] + lines[1][:20])
    assert len(kept(tmp_path, used(3))) == 2
    assert len(kept(tmp_path)) == 3


def test_it_is_written_anew_while_it_is_in_use(tmp_path: Path) -> None:
    journal = Journal(tmp_path, "main", lines=20)
    journal.open()
    (path,) = tmp_path.iterdir()
    for i in range(500):
        journal.keep(used(i % 7, life=100.0 + i))
    journal.close()
    assert len(path.read_bytes().splitlines()) < 30
    assert len(kept(tmp_path)) == 7


@pytest.mark.skipif(sys.platform == "win32", reason="Windows keeps files that are open")
@pytest.mark.parametrize("how", ["another server", "tidied up"])
def test_what_one_has_kept_is_found_whoever_takes_its_file_away(tmp_path: Path, how: str) -> None:
    folder = tmp_path / "state"
    first, second = Journal(folder, "main"), Journal(folder, "main")
    first.open()
    first.keep(used(1))
    until(lambda: b"token-1" in (folder / "main.jsonl").read_bytes())
    if how == "another server":
        second.open()
        second.keep(used(2))
        second.close()
    else:
        shutil.rmtree(folder)
    first.keep(used(3))
    first.close()
    names = {record.jti for record in kept(folder) if isinstance(record, Used)}
    assert names == {"token-1", "token-3"} | ({"token-2"} if how == "another server" else set())


def test_no_file_is_open_while_it_takes_the_place_of_another(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    replace, opened, moved = os.replace, os.open, list[str]()

    def as_on_windows(source: str, target: Path) -> None:
        for number in handles:
            with contextlib.suppress(OSError):
                there = os.fstat(number)
                for path in (source, target):
                    if os.path.exists(path):
                        assert not os.path.samestat(there, os.stat(path)), "sharing violation"
        replace(source, target)
        moved.append(source)

    def noted(*arguments: Any, **more: Any) -> int:
        handles.append(opened(*arguments, **more))
        return handles[-1]

    handles: list[int] = []
    monkeypatch.setattr(os, "open", noted)
    monkeypatch.setattr(os, "replace", as_on_windows)
    journal = Journal(tmp_path, "main", lines=5)
    journal.open()
    for i in range(20):
        journal.keep(used(i % 3))
    journal.close()
    assert len(moved) > 2
    assert len(kept(tmp_path)) == 3


def test_of_a_file_that_is_too_long_the_newest_lines_count(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    kept(tmp_path, *(used(i) for i in range(100)))
    monkeypatch.setattr(module, "_MAX_BYTES", 500)
    names = [record.jti for record in kept(tmp_path) if isinstance(record, Used)]
    assert 3 < len(names) < 20
    assert names[-1] == "token-99"


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no pipes in folders")
def test_a_pipe_in_its_place_is_a_sentence_and_not_waited_for(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "main.jsonl")
    with pytest.raises(SettingError, match="it is no file"):
        Journal(tmp_path, "main").open()


def test_a_folder_that_cannot_be_had_is_a_sentence(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(SettingError, match="can be read and written"):
        Journal(tmp_path / "file", "main").open()


_FULL = """
import logging, resource, sys, threading
from pathlib import Path
from cohaptic_server.credentials import journal
from cohaptic_server.access.remembered import Used
logging.basicConfig(stream=sys.stdout, format="%(message)s")
journal.AGAIN_AFTER = 0.02
kept = journal.Journal(Path(sys.argv[1]), "main")
kept.open()
resource.setrlimit(resource.RLIMIT_FSIZE, (1000, resource.RLIM_INFINITY))
for i in range(50):
    kept.keep(Used(jti=f"token-{i}", ends=1e12))
sys.stdout.write("kept\\n")  # with its end, since the thread logs to the same
sys.stdout.flush()
sys.stdin.readline()
resource.setrlimit(resource.RLIMIT_FSIZE, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
sys.stdin.readline()
kept.close()
"""


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no such limit")
def test_on_a_full_disk_it_waits_and_nothing_is_lost_once_there_is_room(tmp_path: Path) -> None:
    with subprocess.Popen(
        [sys.executable, "-c", _FULL, str(tmp_path)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    ) as process:
        assert process.stdin is not None
        assert process.stdout is not None
        reported = {process.stdout.readline() for _ in range(2)}
        assert "kept\n" in reported  # who keeps something never waits
        assert any("cannot be written" in line for line in reported)
        (path,) = tmp_path.iterdir()
        assert path.stat().st_size <= 1000
        process.stdin.write("room\n")
        process.stdin.flush()
        assert "is written again" in process.stdout.readline()
        process.stdin.write("end\n")
        process.communicate(timeout=PATIENCE)
    assert {record.jti for record in kept(tmp_path) if isinstance(record, Used)} == {
        f"token-{i}" for i in range(50)
    }


def test_a_disk_that_hangs_costs_a_bounded_memory_and_no_wait(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    hanging, entered = threading.Event(), threading.Event()

    def hang(_file: int, data: bytes) -> int:
        entered.set()
        hanging.wait()
        return len(data)

    journal = Journal(tmp_path, "main")
    journal.open()
    monkeypatch.setattr(os, "write", hang)
    journal.keep(used(0))
    entered.wait()
    with caplog.at_level(logging.WARNING):
        for i in range(2 * MAX_WAITING):
            journal.keep(used(i))
    assert caplog.text.count("not kept any more") == 1
    monkeypatch.setattr(module, "_CLOSING", 0.01)
    journal.close()
    hanging.set()


@pytest.mark.skipif(sys.platform == "win32", reason="Windows keeps files that are open")
def test_a_file_that_is_taken_away_meanwhile_ends_nothing(tmp_path: Path) -> None:
    journal = Journal(tmp_path, "main", lines=1)
    journal.open()
    (path,) = tmp_path.iterdir()
    os.unlink(path)
    for i in range(9):
        journal.keep(used(i))
    journal.close()
    until(lambda: bool(list(tmp_path.iterdir())))
