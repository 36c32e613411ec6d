"""A whole server whose state, and log, lie on a full disk: a small tmpfs of the test."""

from __future__ import annotations

import json
import subprocess
import sys
import threading
from collections.abc import Callable, Generator
from pathlib import Path

import pytest

from cohaptic.clock import SystemClock
from cohaptic_tools.demo.processes import Process
from tests.patience import PATIENCE
from tests.small_disk import fill, small_disk

pytestmark = pytest.mark.live
CLOCK = SystemClock()


@pytest.fixture
def disk(tmp_path: Path) -> Generator[Path]:
    with small_disk(tmp_path / "disk", "256k") as folder:
        yield folder


def until(condition: Callable[[], bool]) -> None:
    deadline = CLOCK.now() + PATIENCE
    while not condition():
        assert CLOCK.now() < deadline
        threading.Event().wait(0.05)


def cohaptic(*arguments: str) -> str:
    command = [sys.executable, "-m", "cohaptic", *arguments]
    done = subprocess.run(command, capture_output=True, text=True, check=True, timeout=PATIENCE)
    return done.stdout.strip()


@pytest.mark.parametrize("log_too", [False, True])
def test_on_a_full_disk_a_server_goes_on_and_a_ban_is_written_once_there_is_space(
    disk: Path, tmp_path: Path, *, log_too: bool
) -> None:
    keys = ("--keys", str(tmp_path / "keys"))
    cohaptic("key", str(tmp_path / "keys"))
    log = (disk if log_too else tmp_path) / "server.log"
    server = Process("serve", "--port", "0", *keys, "--state", str(disk / "state"), log=log)
    url = server.first_line().removeprefix("listening ")
    filling = fill(disk)

    def touch(name: str) -> Process:
        token = cohaptic("token", *keys, "--sub", name)
        return Process(
            "touch", url, "--name", name, "--geometry", "plane", "--json-lines",
            "--token", token, log=tmp_path / f"{name}.log",
        )  # fmt: skip

    def state(hand: Process) -> str:
        return str(json.loads(hand.line or "{}").get("state"))

    def goes_on() -> None:
        # On a busy machine its server may be silent for a moment; a hand that loses it ends.
        until(lambda: state(good) == "touching")
        assert good.running

    bad, good = touch("bad"), touch("good")
    try:
        until(lambda: state(bad) == state(good) == "touching")
        admin = cohaptic("token", *keys, "--admin")
        assert cohaptic("admin", url, "ban", "bad", "--token", admin) == "done: ban bad"
        until(lambda: not bad.running)
        assert "banned" in (tmp_path / "bad.log").read_text()
        again = touch("bad")
        until(lambda: not again.running)  # it is known, though it is written nowhere
        again.wait()
        if not log_too:
            until(lambda: "cannot be written" in log.read_text())
        goes_on()
        (journal,) = (disk / "state").glob("*.jsonl")
        assert "bad" not in journal.read_text()
        filling.unlink()
        until(lambda: '"name":"bad"' in journal.read_text())
        goes_on()
        if not log_too:
            assert log.read_text().count("cannot be written") == 1
            assert "Traceback" not in log.read_text()
    finally:
        for process in (bad, good, server):
            process.wait()
