"""The driver through the real hidapi on pads that umockdev mocks, and its thread on a script."""

from __future__ import annotations

import sys
import threading
from collections import deque
from pathlib import Path
from typing import cast

import pytest

from cohaptic.errors import DeviceError
from cohaptic.testing.manual_clock import ManualClock
from cohaptic_client.devices.hid_devices import HidDevice
from cohaptic_drivers.dualsense.link import PadLink
from cohaptic_drivers.dualsense.reports import OFF, SIDES, Effects
from tests.client.devices.mocked import run_mocked
from tests.drivers.dualsense.pad_reports import pad_report, understood

pytestmark = pytest.mark.live

SCRIPT = Path(__file__).with_name("umock_dualsense.py")
RIGHT = SIDES["right"]
FELT = Effects(40, 200, 30)


# Behind a mocked device is a terminal, which keeps no reports apart: a driver that others hold up
# reads parts of two, and takes the pad for another device.
@pytest.mark.alone
@pytest.mark.skipif(sys.platform != "linux", reason="umockdev mocks devices of Linux only")
def test_a_mocked_pad_is_found_pressed_stalled_and_unplugged(tmp_path: Path) -> None:
    seen = run_mocked(SCRIPT, str(tmp_path))
    assert seen["before"] == "dualsense: no DualSense was found; connect one by cable"
    assert seen["rest"] == pytest.approx([0.0, -0.11, 0.0])
    assert seen["first"] == [True]
    assert 151 <= seen["pressed"][0] <= 155  # the tip was near where the trigger is
    assert seen["pressed"][1] == 128
    assert seen["shaken"] > 0  # how many there are in a period is said in virtual time, below
    assert seen["stalled"]["velocity"] == [0.0, 0.0, 0.0]
    assert "it has been silent for" in seen["stalled"]["end"]
    assert "it is closed" in seen["closed"]
    assert "it was unplugged" in seen["unplugged"]
    assert "no DualSense was found" in seen["after"]
    two = seen["two"]
    assert two["found"] == ["dualsense:serial=00:00:00", "dualsense:serial=00:00:01"]
    assert two["left"] == 128
    assert two["other_rests"]
    assert "there is no pad 3; pads are 1 to 2" in two["none"]
    assert "none with the number 7; there is: 00:00:00, 00:00:01" in two["unknown"]
    assert two["knock"][0] > 50
    assert two["knock"][1] == 0
    others = seen["others"]
    assert "what comes from it is no report of a DualSense" in others["garbage"]
    assert "no report of a DualSense" in others["wrong"]
    assert "sends no reports of a DualSense" in others["mute"]
    assert "it is connected by Bluetooth; connect it by cable" in seen["bluetooth"]


class ScriptedPad:
    """A pad that is told of by a script: a report, a silence of 4 ms, or an error, in turn.

    Attributes:
        reported: What it was told, also where that failed.
        at: When [s].
    """

    def __init__(self, script: list[bytes], clock: ManualClock, loop: int = 10**9) -> None:
        self.reported: list[Effects] = []
        self.at: list[float] = []
        self.link: PadLink | None = None
        self.made, self.over = threading.Event(), threading.Event()
        self.given: deque[Effects] = deque()
        self.flood = 0  # reports that are there at once, beside those of the script
        self._script, self._clock, self._loop = list(script), clock, loop
        self._broken = False

    def read(self, size: int, wait: int = 0) -> list[int]:
        assert self.made.wait(30.0)
        assert self.link is not None
        if wait == 0:
            self.flood -= 1
            return list(GOOD) if self.flood >= 0 else []
        if not self._script:
            self._broken = True
            raise OSError("read error")
        each = self._script.pop(0)
        self._clock.sleep_until(self._clock.now() + (0.001 if each else 0.004))
        self._loop -= 1
        if self._loop >= 0:
            self.link.send(self.given.popleft() if self.given else FELT)
        return list(each)[:size]

    def write(self, data: bytes) -> int:
        self.reported.append(understood(data))
        self.at.append(self._clock.now())
        return -1 if self._broken else len(data)

    def close(self) -> None:
        self.over.set()


def told_by(
    script: list[bytes],
    *,
    loop: int = 10**9,
    given: list[Effects] | None = None,
    flood: int = 0,
) -> tuple[ScriptedPad, DeviceError]:
    clock = ManualClock()
    pad = ScriptedPad(script, clock, loop)
    pad.given.extend(given or [])
    pad.flood = flood
    pad.link = PadLink(cast(HidDevice, pad), RIGHT, clock)
    pad.made.set()
    assert pad.over.wait(30.0)
    with pytest.raises(DeviceError) as caught:
        pad.link.send(FELT)
    pad.link.close()
    pad.link.close()
    return pad, caught.value


GOOD = pad_report()


def test_unplugged_in_contact_it_is_told_off_even_if_that_cannot_arrive() -> None:
    pad, error = told_by([GOOD] * 10)
    assert FELT in pad.reported
    assert pad.reported[-2:] == [OFF, OFF]
    assert str(error) == (
        "dualsense: it was unplugged (read error); plug it in again, then start again"
    )


def test_what_changes_all_the_time_is_told_at_most_250_times_a_second() -> None:
    many = [Effects(0, 1 + k % 250) for k in range(200)]
    pad, _ = told_by([GOOD] * 200, given=many)
    gaps = [b - a for a, b in zip(pad.at, pad.at[1:-2], strict=False)]
    assert len(gaps) > 40
    assert min(gaps) >= 0.004 - 1e-9


def test_a_loop_that_gives_nothing_gets_nothing_felt() -> None:
    pad, _ = told_by([GOOD] * 40, loop=0)
    assert set(pad.reported) == {OFF}
    stopped, _ = told_by([GOOD] * 60, loop=10)
    assert stopped.reported == [FELT, OFF, OFF, OFF]
    soon_over, _ = told_by([GOOD] * 25, loop=10)
    assert soon_over.reported == [FELT, OFF, OFF]


@pytest.mark.parametrize(("silence", "felt_all_the_time"), [(4, True), (8, False)])
def test_a_pad_that_is_silent_for_long_gets_nothing_felt(
    silence: int, felt_all_the_time: bool
) -> None:
    pad, _ = told_by([*[GOOD] * 10, *[b""] * silence, *[GOOD] * 10])
    assert (OFF not in pad.reported[:-2]) is felt_all_the_time
    assert pad.reported[-3] == FELT


@pytest.mark.parametrize("garbage", [b"\x01" * 63, b"\x01" * 10, b"\x02" * 64, bytes(64)])
def test_garbage_counts_as_silence_and_a_lot_of_it_as_another_device(garbage: bytes) -> None:
    few, error = told_by([GOOD, *[garbage] * 19, GOOD, *[garbage] * 19, GOOD])
    assert "unplugged" in str(error)
    assert OFF not in few.reported[:-2]
    many, error = told_by([*[GOOD] * 10, *[garbage] * 25, GOOD])
    assert "what comes from it is no report of a DualSense" in str(error)
    assert many.reported[-2:] == [OFF, OFF]
    slow, _ = told_by([*[GOOD] * 10, *[garbage, b""] * 8, *[GOOD] * 10])
    assert slow.reported == [FELT, OFF, FELT, OFF, OFF]


def test_a_pad_on_bluetooth_is_told_in_one_sentence() -> None:
    pad, error = told_by([b"\x31" * 64])
    assert str(error) == "dualsense: it is connected by Bluetooth; connect it by cable"
    assert set(pad.reported) == {OFF}
