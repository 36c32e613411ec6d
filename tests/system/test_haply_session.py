"""A whole session with a force-feedback device: server, two clients, and its service, as processes.

The device's service is the emulator of `tests/drivers/haply`, over its real websocket.
"""

from __future__ import annotations

import json
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from cohaptic.clock import SystemClock
from cohaptic.status.report import TouchStatus
from cohaptic_client.devices.placing.placed import AFTER_LOSS, RETURN_TIME
from cohaptic_drivers.haply.exchange import SILENCE
from cohaptic_drivers.haply.inverse3 import MIDDLE
from cohaptic_server.numeric import Floats
from cohaptic_tools.demo.analysis import Recording
from cohaptic_tools.demo.processes import Process
from tests.patience import PATIENCE

pytestmark = [
    pytest.mark.alone,
    pytest.mark.skipif(sys.platform == "win32", reason="needs POSIX processes"),
]

CLOCK = SystemClock()
REACH = 0.035  # m from the middle of the workspace, outside the balloon, into it
PRESSED = 2.0  # s
TRIED = 5.0  # s for which a press may take until all of it is felt


class Service:
    """The emulator as a process of its own."""

    def __init__(self) -> None:
        command = [sys.executable, "-m", "tests.drivers.haply.emulator", "049D"]
        self._process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )
        assert self._process.stdout is not None
        self.url = f"ws://127.0.0.1:{self._process.stdout.readline().strip()}"

    def tell(self, **command: object) -> None:
        assert self._process.stdin is not None
        self._process.stdin.write(json.dumps(command) + "\n")
        self._process.stdin.flush()

    def saved(self, path: Path) -> Floats:
        """Time (Unix) and force of each command, shape (n, 4)."""
        self.tell(save=str(path))
        assert self._process.stdout is not None
        assert self._process.stdout.readline().strip() == "saved"
        return np.array(json.loads(path.read_text()))

    def end(self) -> None:
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.close()
        self._process.wait(PATIENCE)
        self._process.stdout.close()


@pytest.fixture
def service() -> Iterator[Service]:
    made = Service()
    yield made
    made.end()


def wait_until(process: Process, condition: Callable[[TouchStatus], bool]) -> None:
    deadline = CLOCK.now() + PATIENCE
    while not (process.line and condition(TouchStatus.model_validate_json(process.line))):
        assert process.running, process.words()
        assert CLOCK.now() < deadline, (process.line, process.words())
        threading.Event().wait(0.02)


def status(process: Process) -> TouchStatus:
    return TouchStatus.model_validate_json(process.line)


def press(service: Service, device: Process, other: Process) -> None:
    """Until both feel it; once more after a pause of a busy machine, which lets the hand go."""
    deadline, (x, y, z) = CLOCK.now() + PATIENCE, MIDDLE
    while True:
        service.tell(goal=(x, y + REACH, z))
        tries = CLOCK.now() + TRIED
        while CLOCK.now() < tries:
            felt = [abs(status(process).felt_from_others) for process in (device, other)]
            if status(device).force > 1.0 and min(felt) > 0.05:
                return
            threading.Event().wait(0.02)
        assert CLOCK.now() < deadline, (device.line, device.words(), other.line)
        service.tell(goal=MIDDLE)
        threading.Event().wait(PRESSED)


def test_a_device_presses_on_the_object_of_a_server_and_another_user_feels_it(
    service: Service, tmp_path: Path
) -> None:
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
        device = touch("device", "--device", f"haply:url={service.url}")
        wait_until(device, lambda s: s.state == "free")
        wait_until(other, lambda s: s.state == "touching")
        press(service, device, other)
        threading.Event().wait(PRESSED)
        service.tell(goal=MIDDLE)
        wait_until(device, lambda s: s.force == 0.0)
        device.let_end()
        device.wait()
    finally:
        for process in processes:
            process.wait()
    assert_records_agree(service.saved(tmp_path / "given.json"), tmp_path / "device.npz")


def assert_records_agree(given: Floats, path: Path) -> None:
    """What the service was told is what the client's loop says that it gave."""
    columns = Recording.load(path).columns
    rows = np.column_stack([columns[name] for name in ("t", "fx", "fy", "fz")])
    # At 1 kHz: half of all periods and more are a millisecond, whatever else the machine does.
    assert np.median(np.diff(rows[:, 0])) == pytest.approx(1e-3, rel=0.1)
    pressed = given[np.linalg.norm(given[:, 1:], axis=1) > 0.0]
    assert np.linalg.norm(pressed[:, 1:], axis=1).max() > 1.0
    # What is given after a silence of 20 ms is less for a while, and never more.
    gaps = given[1:, 0][np.diff(given[:, 0]) > SILENCE / 2]
    undisturbed = np.array(
        [
            not ((gaps <= t) & (gaps > t - RETURN_TIME - AFTER_LOSS - SILENCE)).any()
            for t in pressed[:, 0]
        ]
    )
    assert np.linalg.norm(pressed[:, 1:], axis=1).max() <= np.linalg.norm(rows[:, 1:], axis=1).max()
    # Otherwise it is what the loop gave, to the last bit, in the same order.
    at = {tuple(row[1:]): k for k, row in enumerate(rows.tolist())}
    found = [at.get(tuple(force)) for force in pressed[undisturbed, 1:].tolist()]
    known = np.array([k for k in found if k is not None])
    assert len(known) == len(found) > 100
    assert (np.diff(known) >= 0).all()
    assert (given[-2:, 1:] == 0.0).all()
