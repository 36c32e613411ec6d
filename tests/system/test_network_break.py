"""A hand whose network breaks: its connection is cut, or nothing passes for a while."""

from __future__ import annotations

import re
import sys
from collections.abc import Generator
from pathlib import Path

import numpy as np
import pytest

from cohaptic_client.loop.safety import EXTERNAL_RATE
from cohaptic_tools.demo.analysis import Recording
from cohaptic_tools.demo.processes import Process
from tests.system.broken_path import BrokenPath
from tests.system.test_rooms import CLOCK, STEP_TIME, largest_unexplained, port_of, state, until

pytestmark = [
    pytest.mark.alone,
    pytest.mark.skipif(sys.platform == "win32", reason="resets connections"),
]

SILENCE = 5.0  # s for which nothing passes


@pytest.fixture
def server(tmp_path: Path) -> Generator[Process]:
    log = tmp_path / "server.log"
    # No seat but those of the two, so that one that is lost would be missed.
    server = Process("serve", "--port", "0", "--max-users", "2", log=log)
    server.first_line()
    yield server
    server.wait()
    assert "Traceback" not in log.read_text()


def touch(url: str, name: str, folder: Path) -> Process:
    return Process(
        "touch", url, "--name", name, "--wait", "60", "--geometry", "plane",
        "--record", str(folder / f"{name}.npz"), "--json-lines", log=folder / f"{name}.log",
    )  # fmt: skip


def test_a_hand_comes_back_to_its_seat_and_name_with_a_smooth_force(
    server: Process, tmp_path: Path
) -> None:
    url = server.first.removeprefix("listening ")
    path = BrokenPath(port_of(url))
    left, right = touch(path.url, "left", tmp_path), touch(url, "right", tmp_path)
    hands = (left, right)
    until(lambda: all(state(hand)[1] > 1.0 for hand in hands))
    began = CLOCK.now() + CLOCK.to_wall()
    path.takes = False  # else it may be back before its force has gone
    path.cut()
    until(lambda: state(left)[1] < 0.1)
    # Whoever comes meanwhile finds no seat, and the name is not free.
    late = touch(url, "late", tmp_path)
    path.takes = True
    until(lambda: state(left)[1] > 1.0)
    until(lambda: not late.running)  # its start makes the silence no longer
    path.passes = False
    silent = CLOCK.now()
    until(lambda: state(left)[1] == 0.0)
    until(lambda: CLOCK.now() > silent + SILENCE)
    assert state(right)[1] > 0.5
    path.passes = True
    until(lambda: state(left)[1] > 1.0)
    for hand in (*hands, late):
        hand.wait()
    path.close()
    log = (tmp_path / "server.log").read_text()
    assert "number of users is 3; expected at most 2" in (tmp_path / "late.log").read_text()
    # It was away once, and came back as itself; the silence ended nobody's connection.
    assert len(re.findall(r"left joined", log)) == 2
    assert log.count("left left: connection lost") == 1
    assert (tmp_path / "left.log").read_text().count("the connection was lost") == 1
    for name in ("left", "right"):
        c = Recording.load(tmp_path / f"{name}.npz").columns
        force = np.sqrt(c["fx"] ** 2 + c["fy"] ** 2 + c["fz"] ** 2)
        assert force[-1] == 0.0
        assert largest_unexplained(c, began - 0.1) <= EXTERNAL_RATE * STEP_TIME
        if name == "right":
            since = (c["t"] > began) & (c["t"] < c["t"][-1] - 1.0)
            assert force[since].min() > 0.5
