"""A server or a client whose processes stood still, as those of a laptop with its lid shut."""

from __future__ import annotations

import os
import signal
import sys
import threading
from collections.abc import Generator
from pathlib import Path

import numpy as np
import pytest

from cohaptic_client.loop.safety import EXTERNAL_RATE
from cohaptic_tools.demo.analysis import Recording
from cohaptic_tools.demo.processes import Process
from tests.system.test_rooms import CLOCK, STEP_TIME, largest_unexplained, state, until

pytestmark = [
    pytest.mark.alone,
    pytest.mark.skipif(sys.platform == "win32", reason="needs POSIX signals"),
]

NAMES = ("left", "right")
STILL = 14.0  # s; more than the 12 s of samples that a connection may send at once


@pytest.fixture
def server(tmp_path: Path) -> Generator[Process]:
    log = tmp_path / "server.log"
    server = Process("serve", "--port", "0", log=log)
    server.first_line()
    yield server
    server.wait()
    said = log.read_text()
    for accusation in ("too many", "flood", "asked for too much", "Traceback"):
        assert accusation not in said


@pytest.fixture
def hands(server: Process, tmp_path: Path) -> Generator[dict[str, Process]]:
    """Two that press."""
    url = server.first.removeprefix("listening ")
    touching = {
        name: Process(
            "touch", url, "--name", name, "--wait", "60", "--geometry", "plane",
            "--record", str(tmp_path / f"{name}.npz"), "--json-lines", log=tmp_path / f"{name}.log",
        )
        for name in NAMES
    }  # fmt: skip
    until(lambda: all(state(hand)[1] > 1.0 for hand in touching.values()))
    yield touching
    for hand in touching.values():
        hand.wait()


def suspend(process: Process) -> None:
    """Stop it with the processes that it has started, and let all go on after `STILL`."""
    os.killpg(process.pid, signal.SIGSTOP)
    threading.Event().wait(STILL)
    os.killpg(process.pid, signal.SIGCONT)


def end(hands: dict[str, Process], folder: Path) -> dict[str, dict[str, np.ndarray]]:
    """End all, and return what they recorded."""
    for hand in hands.values():
        hand.wait()
    return {name: Recording.load(folder / f"{name}.npz").columns for name in hands}


def test_hands_whose_server_stood_still_touch_again_and_nobody_is_accused(
    server: Process, hands: dict[str, Process], tmp_path: Path
) -> None:
    began = CLOCK.now() + CLOCK.to_wall()
    suspend(server)
    until(lambda: all(state(hand)[1] > 1.0 for hand in hands.values()))
    for c in end(hands, tmp_path).values():
        force = np.sqrt(c["fx"] ** 2 + c["fy"] ** 2 + c["fz"] ** 2)
        still = (c["t"] > began + 2.0) & (c["t"] < began + STILL)
        assert force[still].max() == 0.0
        assert largest_unexplained(c, began - 0.1) <= EXTERNAL_RATE * STEP_TIME


def test_a_client_that_stood_still_is_not_accused_and_the_other_feels_no_jump(
    hands: dict[str, Process], tmp_path: Path
) -> None:
    began = CLOCK.now() + CLOCK.to_wall()
    suspend(hands["left"])
    # It comes back, or ends and says that its machine stood still: a motor may be in any state.
    until(lambda: not hands["left"].running or state(hands["left"])[1] > 1.0)
    said = (tmp_path / "left.log").read_text()
    assert "Traceback" not in said
    assert hands["left"].running or "stood still" in said
    c = end({"right": hands["right"]}, tmp_path)["right"]
    assert largest_unexplained(c, began - 0.1) <= EXTERNAL_RATE * STEP_TIME
