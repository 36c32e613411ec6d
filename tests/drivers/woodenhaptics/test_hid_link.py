"""The driver on the older boards, through the real hidapi and devices that umockdev mocks."""

from __future__ import annotations

import struct
import sys
import threading
from pathlib import Path
from typing import cast

import pytest

from cohaptic.testing.manual_clock import ManualClock
from cohaptic.vec import ZERO, Vec3
from cohaptic_client.devices.hid_devices import HidDevice
from cohaptic_drivers.woodenhaptics.hid_link import HidLink
from cohaptic_drivers.woodenhaptics.reports import GENERATIONS
from tests.client.devices.mocked import run_mocked

pytestmark = pytest.mark.live

SCRIPT = Path(__file__).with_name("umock_wooden.py")
SIZES = {"h1": 8, "h2": 14, "h3": 64}


@pytest.mark.skipif(sys.platform != "linux", reason="umockdev mocks devices of Linux only")
@pytest.mark.parametrize("generation", SIZES)
def test_a_mocked_board_is_found_pressed_garbled_stalled_and_unplugged(
    generation: str, tmp_path: Path
) -> None:
    seen = run_mocked(SCRIPT, str(tmp_path), generation)
    assert "no board was found" in seen["before"]
    assert "differ in the directions of their motors; try it with force=off" in seen["unconfirmed"]
    size = SIZES[generation]
    assert f"sends reports of {size} bytes, not of" in seen["other"]
    assert seen["home"] == pytest.approx([0.0, -0.025, 0.205])
    # of the vectors in test_kinematics.py
    assert seen["pressed"] == pytest.approx([1182.4, -659.6, -2364.9], abs=0.6)
    assert seen["moved"][0] > 0.0
    assert seen["idle"]
    assert seen["second_rests"]
    assert "its encoders jumped; was it calibrated in use?" in seen["garbage"]
    assert "its board has been silent" in seen["stalled"]
    assert seen["after_close"] == [0, 0, 0]
    assert "it was unplugged" in seen["unplugged"]


class ScriptedBoard:
    """A board that sends a report for each 1 of a script and keeps silent for 10 ms for each 0.

    Attributes:
        currents: Of each command [mA].
    """

    def __init__(self, script: str, clock: ManualClock, given: Vec3) -> None:
        self.currents = list[Vec3]()
        self.link: HidLink | None = None
        self.made, self.over = threading.Event(), threading.Event()
        self._script, self._clock, self._given = list(script), clock, given

    def read(self, size: int, _wait: int = 0) -> list[int]:
        assert self.made.wait(30.0)
        assert self.link is not None
        if not self._script:
            raise OSError("the script is over")
        spoke = self._script.pop(0) == "1"
        self._clock.sleep_until(self._clock.now() + (0.001 if spoke else 0.01))
        self.link.send(self._given)  # the loop goes on
        return [0] * size if spoke else []

    def write(self, data: bytes) -> int:
        if self._script:
            a, b, c = struct.unpack_from("<3h", data, 1)
            self.currents.append((float(a), float(b), float(c)))
        return len(data)

    def close(self) -> None:
        self.over.set()


@pytest.mark.parametrize(("silence", "full"), [("0", True), ("00", True), ("00000", False)])
def test_a_report_that_comes_late_costs_no_force_and_a_long_silence_does(
    silence: str, full: bool
) -> None:
    push: Vec3 = (100.0, -200.0, 300.0)
    clock = ManualClock()
    board = ScriptedBoard(f"111{silence}111", clock, push)
    board.link = HidLink(cast(HidDevice, board), GENERATIONS["h2"], clock)
    board.made.set()
    assert board.over.wait(30.0)
    assert (ZERO not in board.currents) is full
    assert board.currents[0] == board.currents[-1] == push
