"""Session files of real servers and clients: read by others' commands, killed, side by side."""

from __future__ import annotations

import os
import signal
import sys
import threading
from collections.abc import Callable
from pathlib import Path

import pytest

from cohaptic.cli.app import main
from cohaptic.clock import SystemClock
from cohaptic.errors import SettingError
from cohaptic.sessions.reader import Outline
from cohaptic_tools.demo.processes import Process
from tests.patience import PATIENCE

pytestmark = [
    pytest.mark.live,
    pytest.mark.skipif(sys.platform == "win32", reason="needs POSIX signals"),
]
CLOCK = SystemClock()
LATEST = 1.0  # s that a killed server may lose: a chunk of half of it, and what its thread has


def until(holds: Callable[[], bool]) -> None:
    deadline = CLOCK.now() + PATIENCE
    while not holds():
        assert CLOCK.now() < deadline
        threading.Event().wait(0.02)


def served(folder: Path, record: Path) -> tuple[Process, str]:
    log = folder / f"{record.stem}.log"
    server = Process("serve", "--port", "0", "--record", str(record), log=log)
    return server, server.first_line().removeprefix("listening ")


def count(path: Path, kind: str) -> int:
    """Number of entries of a kind in a file, 0 before its first bytes are there."""
    try:
        return Outline.of(path).counts.get(kind, 0)
    except SettingError:
        return 0


def run(capsys: pytest.CaptureFixture[str], *words: object) -> str:
    with pytest.raises(SystemExit) as ended:
        main([*map(str, words)])
    assert ended.value.code in (0, None)
    return capsys.readouterr().out


def test_what_a_client_and_its_server_record_say_the_same(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    server, url = served(tmp_path, tmp_path / "lab.mcap")
    own = tmp_path / "ann.mcap"
    client = Process(
        "touch", url, "--name", "ann", "--record", str(own), "--json-lines",
        log=tmp_path / "ann.log",
    )  # fmt: skip
    until(lambda: count(own, "Rows") >= 20)
    client.wait()
    server.wait()
    for path in (own, tmp_path / "lab.mcap"):
        outline = Outline.of(path)
        assert outline.complete
        assert outline.users == {1: "ann"}
        # The period nearest to that time: a loop may have left some out beside other work.
        answer = run(capsys, "why", path, "--user", "ann", "--at", "1")
        assert answer.startswith("ann, ")
        assert "s after the beginning" in answer
        assert "The hand was given" in answer
    assert "the same to the last bit" in run(capsys, "replay", tmp_path / "lab.mcap", "--verify")


def test_a_killed_server_leaves_all_but_the_last_second(tmp_path: Path) -> None:
    path = tmp_path / "lab.mcap"
    server, url = served(tmp_path, path)
    client = Process("touch", url, "--name", "ann", "--json-lines", log=tmp_path / "ann.log")
    until(lambda: count(path, "Patched") >= 150)
    killed_at = CLOCK.now() + CLOCK.to_wall()
    os.kill(server.pid, signal.SIGKILL)
    server.wait()
    outline = Outline.of(path)
    assert not outline.complete
    assert outline.users == {1: "ann"}
    assert outline.last + outline.info.to_wall > killed_at - LATEST
    client.wait()


def test_two_rooms_are_recorded_side_by_side(tmp_path: Path) -> None:
    paths = [tmp_path / f"{name}.mcap" for name in ("one", "two")]
    rooms = [served(tmp_path, path) for path in paths]
    clients = [
        Process("touch", url, "--name", f"in {path.stem}", "--json-lines", log=tmp_path / path.stem)
        for path, (_, url) in zip(paths, rooms, strict=True)
    ]
    until(lambda: all(count(path, "Rows") >= 10 for path in paths))
    for process in (*clients, *(server for server, _ in rooms)):
        process.wait()
    for path in paths:
        outline = Outline.of(path)
        assert outline.complete
        assert list(outline.users.values()) == [f"in {path.stem}"]
