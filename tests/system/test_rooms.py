"""Rooms as people and scripts start them: `serve --config`, and hands that touch in them."""

from __future__ import annotations

import json
import os
import re
import signal
import socket
import subprocess
import sys
import threading
from collections.abc import Callable, Generator
from pathlib import Path

import numpy as np
import pytest

from cohaptic.clock import SystemClock
from cohaptic_client.loop.passivity import MAX_DAMPING
from cohaptic_client.loop.safety import EXTERNAL_RATE
from cohaptic_tools.demo.analysis import STEP, Recording
from cohaptic_tools.demo.processes import Process
from tests.patience import PATIENCE
from tests.system.broken_path import BrokenPath

pytestmark = [
    pytest.mark.alone,
    pytest.mark.skipif(sys.platform == "win32", reason="hands sockets over"),
]

CLOCK = SystemClock()
STEP_TIME = 0.02  # s over which a jump is measured: more than a scheduler's hiccup
CONFIG = """
port = 0
[rooms.main]
body = "balloon"
[rooms.other]
body = "balloon"
"""


class Rooms:
    """The processes of a server."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.log = folder, folder / "server.log"
        path = folder / "rooms.toml"
        path.write_text(CONFIG)
        self.process = Process("serve", "--config", str(path), log=self.log)
        self.url = self.process.first_line().removeprefix("listening ")

    def pids(self, room: str) -> list[int]:
        """Processes of a room, the newest last."""
        found = re.findall(rf"room {room} is open, process (\d+)", self.log.read_text())
        return [int(pid) for pid in found]

    def touch(self, room: str, url: str = "") -> Process:
        return Process(
            "touch", url or self.url, "--room", room, "--name", room, "--wait", "60",
            "--geometry", "plane", "--record", str(self.folder / f"{room}.npz"), "--json-lines",
            log=self.folder / f"{room}.log",
        )  # fmt: skip


@pytest.fixture
def rooms(tmp_path: Path) -> Generator[Rooms]:
    server = Rooms(tmp_path)
    yield server
    server.process.wait()
    assert "Traceback" not in server.log.read_text()


def until(condition: Callable[[], bool]) -> None:
    deadline = CLOCK.now() + PATIENCE
    while not condition():
        assert CLOCK.now() < deadline
        threading.Event().wait(0.05)


def state(hand: Process) -> tuple[str, float]:
    reported = json.loads(hand.line or "{}")
    return str(reported.get("state")), float(reported.get("force", 0.0))


@pytest.mark.smoke
def test_after_a_room_was_killed_a_hand_comes_back_smoothly_and_the_other_felt_nothing(
    rooms: Rooms, tmp_path: Path
) -> None:
    path = BrokenPath(port_of(rooms.url))
    hands = {"main": rooms.touch("main", path.url), "other": rooms.touch("other")}
    until(lambda: all(state(hand)[1] > 1.0 for hand in hands.values()))
    # So that both are in for all of the time that is looked at.
    threading.Event().wait(0.3)
    (pid,) = rooms.pids("main")
    # On a link with pauses a loop waits for longer, and might be back before its force has gone.
    path.takes = False
    killed = CLOCK.now() + CLOCK.to_wall()
    os.kill(pid, signal.SIGKILL)
    until(lambda: len(rooms.pids("main")) == 2)
    # It has let go, then it presses again.
    until(lambda: state(hands["main"])[1] < 0.1)
    path.takes = True
    until(lambda: state(hands["main"])[0] == "touching")
    until(lambda: state(hands["main"])[1] > 1.0)
    for hand in hands.values():
        hand.wait()
    path.close()
    for room in hands:
        c = Recording.load(tmp_path / f"{room}.npz").columns
        force = np.sqrt(c["fx"] ** 2 + c["fy"] ** 2 + c["fz"] ** 2)
        since = c["t"] > killed - 0.1
        assert force[-1] == 0.0
        # Nothing but the hand itself moves its force faster than others may.
        assert largest_unexplained(c, killed - 0.1) <= EXTERNAL_RATE * STEP_TIME
        lost = "the connection was lost" in (tmp_path / f"{room}.log").read_text()
        assert lost == (room == "main")
        if room == "other":
            end = c["t"][-1] - 1.0  # s; then it lets go
            assert force[since & (c["t"] < end)].min() > 0.5


def largest_unexplained(c: dict[str, np.ndarray], since: float) -> float:
    """Largest change of a force within `STEP_TIME` that the hand's own way does not cause [N]."""
    t = np.arange(since, c["t"][-1], STEP)
    force, tip = (
        np.stack([np.interp(t, c["t"], c[key]) for key in keys], axis=1)
        for keys in (("fx", "fy", "fz"), ("x", "y", "z"))
    )
    n = round(STEP_TIME / STEP)
    change, way = (np.linalg.norm(a[n:] - a[:-n], axis=1) for a in (force, tip))
    stiffness = float(c["k_h"].max()) + MAX_DAMPING / STEP_TIME
    return float((change - stiffness * way).max())


def test_a_second_signal_ends_everything_at_once_and_leaves_no_shared_memory(
    rooms: Rooms,
) -> None:
    shared = Path("/dev/shm")
    before = set(shared.iterdir()) if shared.is_dir() else set[Path]()
    pids = [pid for room in ("main", "other") for pid in rooms.pids(room)]
    for pid in pids:  # neither can end by itself
        os.kill(pid, signal.SIGSTOP)
    os.kill(rooms.process.pid, signal.SIGTERM)
    until(lambda: not listens(rooms.url))  # else two signals may come as one
    os.kill(rooms.process.pid, signal.SIGTERM)
    until(lambda: not rooms.process.running)
    until(lambda: not any(is_there(pid) for pid in pids))
    mine = {path.name for path in set(shared.iterdir()) - before} if shared.is_dir() else set[str]()
    assert not any(name.startswith(("pym-", "cohaptic-serve")) for name in mine)


def port_of(url: str) -> int:
    return int(url.rpartition(":")[2])


def listens(url: str) -> bool:
    try:
        socket.create_connection(("127.0.0.1", port_of(url)), timeout=PATIENCE).close()
    except ConnectionError:
        return False
    return True


def is_there(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    return True


def test_the_first_signal_lets_the_rooms_end_in_order(rooms: Rooms) -> None:
    hand = rooms.touch("main")
    until(lambda: state(hand)[1] > 0.5)
    os.kill(rooms.process.pid, signal.SIGTERM)
    until(lambda: not rooms.process.running)
    assert "main left: the server stops" in rooms.log.read_text()
    until(lambda: "the server stops" in (rooms.folder / "main.log").read_text())
    hand.wait()


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["--port", "1"], "--port is given; it must be left out beside --config"),
        ([], "rooms.toml: 2 keys are wrong:\n  rooms.main.body is 'lung'"),
    ],
)
def test_what_cannot_be_served_is_said_before_anything_starts(
    tmp_path: Path, arguments: list[str], sentence: str
) -> None:
    path = tmp_path / "rooms.toml"
    path.write_text("[rooms.main]\nbody = 'lung'\n[rooms.main.object]\nedge = 3\n")
    done = subprocess.run(
        [sys.executable, "-m", "cohaptic", "serve", "--config", str(path), *arguments],
        capture_output=True,
        text=True,
        timeout=PATIENCE,
    )
    assert done.returncode == 2
    assert sentence in done.stderr
    assert "Traceback" not in done.stderr
