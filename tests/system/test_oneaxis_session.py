"""A whole session with a one-axis board: server, two clients, and the real firmware, as processes.

The board is that of `tests/drivers/oneaxis`, behind a pseudo-terminal.
"""

from __future__ import annotations

import contextlib
import json
import os
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from cohaptic.clock import SystemClock
from cohaptic.status.report import TouchStatus
from cohaptic_server.numeric import Floats
from cohaptic_tools.demo.analysis import Recording
from cohaptic_tools.demo.processes import Process
from tests.patience import PATIENCE

pytestmark = [
    pytest.mark.alone,
    pytest.mark.skipif(sys.platform == "win32", reason="there are no pseudo-terminals"),
]

CLOCK = SystemClock()
REACH = 0.02  # m from the middle of the handle, before the balloon, into it
PRESSED = 1.5  # s
TRIED = 5.0  # s for which a press may take until all of it is felt
PER_AMPERE = 6.0  # N at the handle, of the rig's motor and of the file
UNIT = """
counts_per_metre = 80000
sensor_direction = 1
motor_direction = 1
torque_constant = 0.03
gear = 20
handle_radius = 0.1
"""


class Rig:
    """The board as a process of its own."""

    def __init__(self) -> None:
        command = [sys.executable, "-m", "tests.drivers.oneaxis.board"]
        self._process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )
        self.port = self._line()

    def tell(self, **command: object) -> None:
        assert self._process.stdin is not None
        self._process.stdin.write(json.dumps(command) + "\n")
        self._process.stdin.flush()

    def saved(self, path: Path) -> Floats:
        """Time [s] and current [A] of the motor, whenever it changed, shape (n, 2)."""
        self.tell(save=str(path))
        assert self._line() == "saved"
        return np.array(json.loads(path.read_text()))

    def end(self) -> None:
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.close()
        self._process.wait(PATIENCE)
        self._process.stdout.close()

    def _line(self) -> str:
        assert self._process.stdout is not None
        return self._process.stdout.readline().strip()


@pytest.fixture
def rig() -> Iterator[Rig]:
    made = Rig()
    yield made
    made.end()


def wait_until(process: Process, condition: Callable[[TouchStatus], bool]) -> None:
    deadline = CLOCK.now() + PATIENCE
    while not (process.line and condition(TouchStatus.model_validate_json(process.line))):
        assert process.running, process.words()
        assert CLOCK.now() < deadline, (process.line, process.words())
        threading.Event().wait(0.02)


def test_a_handle_presses_on_the_object_of_a_server_and_another_user_feels_it(
    rig: Rig, tmp_path: Path
) -> None:
    unit = tmp_path / "mine.toml"
    unit.write_text(UNIT)
    server = Process("serve", "--port", "0", "--quiet", log=tmp_path / "server.log")
    processes = [server]

    def touch(name: str, *options: str) -> Process:
        process = Process(
            "touch", url, "--name", name, "--wait", f"{PATIENCE:g}", "--geometry", "plane",
            "--record", str(tmp_path / f"{name}.npz"), "--json-lines", "--no-hold-faults", *options,
            log=tmp_path / f"{name}.log",
        )  # fmt: skip
        processes.insert(0, process)
        return process

    try:
        url = server.first_line().removeprefix("listening ")
        other = touch("other", "--angle", "90", "--depth-mm", "8")
        device = touch("device", "--device", f"oneaxis:port={rig.port},unit={unit}")
        wait_until(device, lambda s: s.state == "free")
        wait_until(other, lambda s: s.state == "touching")
        felt = (device, other)
        press(rig, device, lambda: all(abs(status(p).felt_from_others) > 0.05 for p in felt))
        threading.Event().wait(PRESSED)
        rig.tell(goal=0.0)
        wait_until(device, lambda s: s.force == 0.0)
        device.let_end()
        device.wait()
    finally:
        for process in processes:
            process.wait()
    assert_records_agree(rig.saved(tmp_path / "given.json"), tmp_path / "device.npz")


def loop_of(port: str) -> int:
    """The process of the haptic loop on a board."""
    for pid in filter(str.isdigit, os.listdir("/proc")):
        with contextlib.suppress(OSError):  # it ended meanwhile
            command = Path("/proc", pid, "cmdline").read_bytes()
            if b"cohaptic_client.loop.process" in command and port.encode() in command:
                return int(pid)
    raise AssertionError(port)


def status(process: Process) -> TouchStatus:
    return TouchStatus.model_validate_json(process.line)


def press(rig: Rig, device: Process, felt: Callable[[], bool] = lambda: True) -> None:
    """Into the object until there is force; once more after a pause of a machine that is busy."""
    deadline = CLOCK.now() + PATIENCE
    while True:
        rig.tell(goal=REACH)
        tries = CLOCK.now() + TRIED
        while CLOCK.now() < tries:
            if status(device).force > 1.0 and felt():
                return
            threading.Event().wait(0.02)
        assert CLOCK.now() < deadline, (device.line, device.words())
        rig.tell(goal=0.0)
        threading.Event().wait(PRESSED)


@pytest.mark.skipif(sys.platform != "linux", reason="looks into /proc")
@pytest.mark.parametrize("name", ["SIGSTOP", "SIGKILL"])
def test_a_loop_that_is_stopped_or_killed_in_contact_leaves_no_current(
    rig: Rig, tmp_path: Path, name: str
) -> None:
    """The board lets go by itself, and a loop that goes on gives none to a hand in the object."""
    unit, record = tmp_path / "mine.toml", tmp_path / "given.json"
    unit.write_text(UNIT)
    server = Process("serve", "--port", "0", "--quiet", log=tmp_path / "server.log")
    url = server.first_line().removeprefix("listening ")
    options = (
        "--device",
        f"oneaxis:port={rig.port},unit={unit}",
        "--wait",
        f"{PATIENCE:g}",
        "--no-hold-faults",
    )
    device = Process("touch", url, *options, "--json-lines", log=tmp_path / "device.log")
    try:
        wait_until(device, lambda s: s.state == "free")
        press(rig, device)
        loop = loop_of(rig.port)
        os.kill(loop, getattr(signal, name))
        deadline = CLOCK.now() + PATIENCE
        assert abs(rig.saved(record)[:, 1]).max() * PER_AMPERE > 1.0
        before = -1
        while rig.saved(record)[-1, 1] != 0.0 or len(rig.saved(record)) != before:
            assert CLOCK.now() < deadline
            before = len(rig.saved(record))
            threading.Event().wait(0.2)  # a board that is late has a last command to read
        if name == "SIGSTOP":
            os.kill(loop, signal.SIGCONT)
            wait_until(device, lambda s: "the loop stood still for" in s.fault)
        else:
            while device.running:
                assert CLOCK.now() < deadline
                threading.Event().wait(0.02)
            assert "oneaxis: its process was ended by SIGKILL; start again" in device.words()
        assert len(rig.saved(record)) == before  # none has come again
    finally:
        device.wait()
        server.wait()


def assert_records_agree(given: Floats, path: Path) -> None:
    """What the motor had is what the client's loop says that it gave, along the axis."""
    columns = Recording.load(path).columns
    times, forces = columns["t"], columns["fy"]
    # At 1 kHz: half of all periods and more are a millisecond, whatever else the machine does.
    assert np.median(np.diff(times)) == pytest.approx(1e-3, rel=0.1)
    currents = given[:, 1]
    assert PER_AMPERE * np.abs(currents).max() > 1.0
    assert np.abs(currents).max() <= 0.5
    assert (currents <= 0.0).all()  # an object pushes toward the user and never away
    assert currents[-1] == 0.0
    # A current is whole milliamperes, which are 6 mN. Each that the motor had, the loop gave, but
    # for what came back along a ramp after a pause of the machine, which is less.
    steps = np.unique(np.round(1e3 * forces / PER_AMPERE))
    known = np.isin(np.round(1e3 * currents), steps)
    assert np.mean(known) > 0.9
    assert len(currents) > 100
    assert np.abs(currents).max() <= np.abs(forces).max() / PER_AMPERE + 1e-3
