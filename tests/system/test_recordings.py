"""Recordings of real clients that are killed, meet on one name, or lose their folder."""

from __future__ import annotations

import json
import os
import random
import shutil
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Generator
from pathlib import Path

import pytest

from cohaptic.clock import SystemClock
from cohaptic.recording.archive import read_recording
from cohaptic_tools.demo.processes import Process
from tests.patience import PATIENCE

pytestmark = [
    pytest.mark.live,
    pytest.mark.skipif(sys.platform == "win32", reason="needs POSIX signals"),
]

CLOCK = SystemClock()
LATEST = 1.0  # s that a killed process may lose


@pytest.fixture
def url(tmp_path: Path) -> Generator[str]:
    server = Process("serve", "--port", "0", log=tmp_path / "server.log")
    yield server.first_line().removeprefix("listening ")
    server.wait()


def touch(url: str, name: str, record: Path, *options: str) -> Process:
    return Process(
        "touch", url, "--name", name, "--geometry", "plane", "--record", str(record),
        "--json-lines", *options, log=record.parent.parent / f"{name}.log",
    )  # fmt: skip


def until(condition: Callable[[], bool]) -> None:
    deadline = CLOCK.now() + PATIENCE
    while not condition():
        assert CLOCK.now() < deadline
        threading.Event().wait(0.02)


def seconds(path: Path) -> float:
    """How much of a recording is there; 0 where there is no file."""
    outline = read_recording(path).outline if path.exists() else None
    return 0.0 if outline is None else outline.last - outline.first


def ended(process: Process) -> str:
    until(lambda: not process.running)
    process.wait()
    return process.words()


def command(*words: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "cohaptic", *words], capture_output=True, text=True, check=False,
        timeout=PATIENCE, stdin=subprocess.DEVNULL,
    )  # fmt: skip


@pytest.mark.parametrize(
    "seed", [pytest.param(s, marks=pytest.mark.night) for s in range(10)] + [10]
)
def test_a_killed_client_loses_a_second_at_most(tmp_path: Path, url: str, seed: int) -> None:
    """At a random moment, while it replaces an older recording."""
    folder = tmp_path / "folder"
    folder.mkdir()
    path, part = folder / "ann.npz", folder / "ann.npz.part"
    path.write_bytes(b"an earlier one")
    hand = touch(url, "ann", path, "--overwrite")
    length = random.Random(seed).uniform(0.3, 4.0)
    until(lambda: seconds(part) > length)
    killed_at = CLOCK.now() + CLOCK.to_wall()
    os.kill(hand.pid, signal.SIGKILL)
    hand.wait()
    found = read_recording(part)
    assert found.outline.last + found.to_wall > killed_at - LATEST
    assert found.outline.intact
    assert path.read_bytes() == b"an earlier one"
    refused = ended(touch(url, "bob", path, "--overwrite"))
    assert f"cohaptic recording --finish {part}" in refused
    assert command("recording", "--finish", str(part)).returncode == 2  # the earlier one is there
    assert path.read_bytes() == b"an earlier one"
    done = command("recording", "--finish", "--overwrite", str(part))
    assert done.returncode == 0, done.stderr
    assert len(read_recording(path).rows) == len(found.rows)
    assert list(folder.iterdir()) == [path]


def test_without_its_folder_the_recording_ends_and_the_hand_goes_on(
    tmp_path: Path, url: str
) -> None:
    folder = tmp_path / "folder"
    folder.mkdir()
    hand = touch(url, "ann", folder / "ann.npz")
    log = tmp_path / "ann.log"
    until(lambda: seconds(folder / "ann.npz.part") > 0.5)
    before = seconds(folder / "ann.npz.part")
    shutil.rmtree(folder)
    until(lambda: "and the hand goes on" in log.read_text())
    reported = hand.line
    until(lambda: hand.line != reported)
    assert json.loads(hand.line)["state"] in ("free", "touching")
    hand.wait()
    kept = Path(hand.words().partition("are kept in ")[2].partition(";")[0])
    assert seconds(kept) >= before
    kept.unlink()
