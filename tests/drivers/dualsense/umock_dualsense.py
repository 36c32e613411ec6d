"""Gamepads made by umockdev, and the driver on them; prints the events as JSON.

Run by `test_link.py` as `umockdev-wrapper python umock_dualsense.py DIRECTORY`. The device end is a
stream of bytes: the pad here takes reports by their length.
"""

from __future__ import annotations

import contextlib
import json
import math
import os
import select
import sys
import threading
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

from cohaptic.clock import SystemClock
from cohaptic.errors import DeviceError
from cohaptic.vec import Vec3
from cohaptic_client.devices.catalogue import open_device, read_device
from cohaptic_client.devices.device import Device
from cohaptic_client.devices.pulse import pulse
from cohaptic_drivers.dualsense import dualsense_kind
from cohaptic_drivers.dualsense import pad as pad_module
from cohaptic_drivers.dualsense.dualsense_kind import find_pads
from cohaptic_drivers.dualsense.reports import NAME, OFF, Effects
from tests.client.devices.umock import MockHid, load_umockdev, plug_in
from tests.client.devices.until import SteadyClock, until
from tests.client.plane import CONFIG
from tests.drivers.dualsense.pad_reports import pad_report, understood

CLOCK, STEADY = SystemClock(), SteadyClock()
ENOUGH = 25  # reports that are none: 20 are too many, and few wait for who opens the pad next
LONG = 20.0  # s for a first report that comes
PUSH: Vec3 = (0.0, -1.5, 0.0)  # N; half of the full force, against the pull
# A gamepad with an input report 1 of 63 bytes and an output report 2 of 47.
DESCRIPTOR = bytes.fromhex(
    "05 01 09 05 a1 01 15 00 26 ff 00 75 08"
    "85 01 09 30 95 3f 81 02  06 00 ff 85 02 09 21 95 2f 91 02 c0"
)


class MockPad:
    """A pad on a mocked node: it sends a report every 4 ms, and keeps what it is told.

    It is silent while no program has it open: nobody would take what it sends.
    """

    def __init__(self, testbed: Any, directory: Path, number: int, product: int = 0x0CE6) -> None:
        name, serial = "DualSense Wireless Controller", f"00:00:0{number}"
        mock = MockHid(0x054C, product, "Sony", name, DESCRIPTOR, number, serial)
        self.raw = plug_in(testbed, directory, mock)
        self._says = (pad_report(), math.inf)
        self.silent = True
        self.reported: list[Effects] = []
        self._testbed = testbed
        self._end: int = testbed.get_dev_fd(mock.node)
        self._ends = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    @property
    def last(self) -> Effects | None:
        return self.reported[-1] if self.reported else None

    def say(self, report: bytes, times: float = math.inf) -> None:
        """Send this from now on, and after so many times nothing."""
        self._says = (report, times)

    def unplug(self) -> None:
        self._ends.set()
        self._thread.join()
        os.close(self._end)
        self._testbed.remove_device(self.raw)

    def _run(self) -> None:
        waiting, due = b"", CLOCK.now()
        says, sent = self._says, 0
        while not self._ends.is_set():
            if says is not self._says:
                says, sent = self._says, 0
            if select.select([self._end], [], [], 0.001)[0]:
                with contextlib.suppress(OSError):
                    waiting += os.read(self._end, 4096)
            while len(waiting) >= 48:
                report, waiting = waiting[:48], waiting[48:]
                block = 22 if report[1] & 0x08 else 11
                self.reported.append(understood(report, block))
            if CLOCK.now() >= due and not self.silent and sent < says[1]:
                due, sent = CLOCK.now() + 0.004, sent + 1
                os.write(self._end, says[0])


def opened(pad: MockPad | None = None, options: str = "") -> Device:
    if pad is not None:
        pad.silent = False
    choice = read_device(f"dualsense:{options}".removesuffix(":"))
    return open_device(replace(CONFIG.device, choice=choice))


def close(device: Device, pad: MockPad) -> None:
    pad.silent = True
    device.close()
    until(lambda: all(thread.name != NAME for thread in threading.enumerate()))
    until(lambda: pad.reported[-2:] == [OFF, OFF])  # what the driver says last


def sentence_of(action: Callable[[], object]) -> str:
    try:
        action()
    except DeviceError as error:
        return str(error)
    return ""


def end_of(device: Device) -> str:
    reported: list[str] = []

    def ended() -> bool:
        reported.append(sentence_of(lambda: device.read(STEADY.now())))
        return reported[-1] != ""

    until(ended)
    return reported[-1]


def press(device: Device, pad: MockPad, strength: int = 128) -> Effects:
    """Pull the trigger and write a force until all of it is felt at the pad."""
    pad.say(pad_report(r2=155, l2=155))
    until(lambda: device.read(STEADY.now()).position[1] > -0.0925)  # 30 mm * 150/250, from 110 mm
    before = len(pad.reported)
    felt: list[Effects] = []

    def given() -> bool:
        device.read(STEADY.now())
        device.write(PUSH)
        reported = pad.reported[
            before:
        ]  # nothing is felt again where this loop has been late since
        felt[:] = [each for each in reported if each.resistance == strength and each.rumble == 0]
        return bool(felt)

    until(given)
    return felt[-1]


def shaken(device: Device, pad: MockPad) -> int:
    """Reports to the pad under a force that changes all the time."""
    start, before, k = CLOCK.now(), len(pad.reported), 0
    # A pad that stands still is told later.
    while (passed := CLOCK.now() - start) < 0.4 or (len(pad.reported) == before and passed < 20.0):
        k += 1
        device.read(STEADY.now())
        device.write((0.0, -0.5 - 0.01 * (k % 100), 0.0))
        CLOCK.sleep_until(CLOCK.now() + 0.001)
    return len(pad.reported) - before


def stalled(device: Device, pad: MockPad) -> dict[str, object]:
    pad.silent = True
    until(lambda: not device.read(STEADY.now()).fresh)
    first = device.read(STEADY.now())
    seen: dict[str, object] = {"velocity": first.velocity, "end": end_of(device)}
    until(lambda: pad.last == OFF)
    return seen


def two_pads(one: MockPad, two: MockPad) -> dict[str, object]:
    seen: dict[str, object] = {"found": [each.choice for each in find_pads()]}
    rest, first = len(one.reported), opened(two, "serial=00:00:01")
    press(first, two)
    close(first, two)
    second = opened(two, "left,number=2")
    seen["left"] = press(second, two).resistance
    close(second, two)
    seen["other_rests"] = len(one.reported) == rest
    seen["none"] = sentence_of(lambda: opened(None, "number=3"))
    seen["unknown"] = sentence_of(lambda: opened(None, "serial=7"))
    two.reported.clear()
    pulse(opened(two, "number=2"), SteadyClock())  # no knock is passed over
    two.silent = True
    until(lambda: two.last == OFF)
    seen["knock"] = [max(e.rumble for e in two.reported), max(e.resistance for e in two.reported)]
    return seen


def others(pad: MockPad) -> dict[str, str]:
    """What is said of what has the pad's ids and is something else."""
    seen = dict[str, str]()
    device = opened(pad)
    press(device, pad)
    pad.say(b"\x09" * 64, ENOUGH)
    seen["garbage"] = end_of(device)
    close(device, pad)
    dualsense_kind.FIRST_REPORT = 1.0
    seen["mute"] = sentence_of(opened)
    dualsense_kind.FIRST_REPORT = LONG
    pad.say(b"\x09" * 64, ENOUGH)
    seen["wrong"] = sentence_of(lambda: opened(pad))
    pad.silent = True
    pad.say(pad_report())
    return seen


def bluetooth(pad: MockPad) -> str:
    """What is said of a pad whose reports are those of Bluetooth; older ones may come first."""
    pad.say(b"\x31" * 64, ENOUGH)
    device: list[Device] = []
    reported = sentence_of(lambda: device.append(opened(pad)))
    return reported or end_of(device[0])


def main() -> None:
    # A machine that is busy with other tests; `test_pad.py` has that it is a quarter of a second.
    pad_module.GIVE_UP = 2.0
    dualsense_kind.FIRST_REPORT = LONG
    testbed, directory = load_umockdev().Testbed.new(), Path(sys.argv[1])
    seen: dict[str, object] = {"before": sentence_of(opened)}
    one = MockPad(testbed, directory, 0)
    device = opened(one)
    seen["rest"] = device.read(STEADY.now()).position
    seen["first"] = [one.last is None or one.last == OFF]
    pressed = press(device, one)
    seen["pressed"] = [pressed.start, pressed.resistance]
    until(lambda: one.last == OFF)  # nobody wrote for a while
    seen["shaken"] = shaken(device, one)
    seen["stalled"] = stalled(device, one)
    device.close()

    device = opened(one)
    press(device, one)
    close(device, one)
    seen["closed"] = sentence_of(lambda: device.read(STEADY.now()))

    two = MockPad(testbed, directory, 1, 0x0DF2)
    seen["two"] = two_pads(one, two)
    seen["others"] = others(one)
    device = opened(one)
    press(device, one)
    one.unplug()
    seen["unplugged"] = end_of(device)
    device.close()
    seen["bluetooth"] = bluetooth(two)
    two.unplug()
    seen["after"] = sentence_of(opened)
    print(json.dumps(seen))


if __name__ == "__main__":
    main()
