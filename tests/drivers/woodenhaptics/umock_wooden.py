"""HID boards made by umockdev, and the driver on them; prints the events as JSON.

Run by `test_hid_link.py` as `umockdev-wrapper python umock_wooden.py DIRECTORY GENERATION`. The
device end is a stream of bytes: the board here takes commands and sends reports by their length.
"""

from __future__ import annotations

import contextlib
import json
import os
import select
import struct
import sys
import threading
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any
from unittest.mock import patch

from cohaptic.errors import DeviceError
from cohaptic.vec import ZERO, Vec3
from cohaptic_client.devices.catalogue import open_device, read_device
from cohaptic_client.devices.device import Device
from cohaptic_drivers.woodenhaptics import arm, wooden_kind
from tests.client.devices.umock import MockHid, load_umockdev, plug_in
from tests.client.devices.until import SteadyClock, until
from tests.client.plane import CONFIG

CLOCK = SteadyClock()
PUSH: Vec3 = (2.0, -1.0, 3.0)
FULL = [1182, -660, -2365]  # mA, of `PUSH` at home: in whole ones, once it has faded in
USB = {"h1": (0x1234, 0x0006), "h2": (0x1234, 0x0006), "h3": (0x16C0, 0x0486)}
SIZES = {"h1": 8, "h2": 14, "h3": 64}


def descriptor(size: int) -> bytes:
    """Vendor-defined reports of some bytes, both ways."""
    fields = bytes([0x15, 0x00, 0x26, 0xFF, 0x00, 0x75, 0x08, 0x95, size])
    return b"\x06\x00\xff\x09\x01\xa1\x01" + fields + b"\x09\x01\x81\x02\x09\x02\x91\x02\xc0"


class Board:
    """A board on a mocked node: H1 sends a report for itself, the others one for each command."""

    def __init__(self, testbed: Any, directory: Path, generation: str, number: int) -> None:
        self.generation, self.size = generation, SIZES[generation]
        vendor, product = USB[generation]
        mock = MockHid(vendor, product, "mbed", "HID", descriptor(self.size), number, str(number))
        self.raw = plug_in(testbed, directory, mock)
        self.counts, self.button, self.silent = (0, 0, 0), False, False
        self.currents: tuple[int, ...] = (0, 0, 0)
        self.given = list[tuple[int, ...]]()  # one after the other
        self.sent = self.taken = 0
        self._testbed = testbed
        self._end: int = testbed.get_dev_fd(mock.node)
        self._ends = threading.Event()
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    def unplug(self) -> None:
        self._ends.set()
        self._thread.join()
        os.close(self._end)
        self._testbed.remove_device(self.raw)

    def _run(self) -> None:
        waiting = b""
        while not self._ends.is_set():
            if select.select([self._end], [], [], 0.001)[0]:
                with contextlib.suppress(OSError):
                    waiting += os.read(self._end, 4096)
            # The kernel takes the zero of an unnumbered report away; a mock hands it on.
            whole = self.size + 1
            while len(waiting) >= whole:
                self.currents = struct.unpack_from("<3h", waiting, 1)
                self.given.append(self.currents)
                waiting, self.taken = waiting[whole:], self.taken + 1
                self._report()
            if self.generation == "h1" and self.sent - self.taken < 3:
                self._report()

    def _report(self) -> None:
        if self.silent:
            return
        self.sent += 1
        wrist = [10012 if self.button else 12, 0, 0, 0] if self.generation != "h1" else [0]
        body = struct.pack(f"<{3 + len(wrist)}h", *self.counts, *wrist)
        os.write(self._end, body.ljust(self.size, b"\0"))


def opened(options: str) -> Device:
    choice = read_device(f"woodenhaptics:place=center,{options}")
    return open_device(replace(CONFIG.device, choice=choice))


def sentence_of(action: Callable[[], object]) -> str:
    try:
        action()
    except DeviceError as error:
        return str(error)
    return ""


def end_of(device: Device) -> str:
    reported: list[str] = []

    def ended() -> bool:
        reported.append(sentence_of(lambda: device.read(CLOCK.now())))
        return reported[-1] != ""

    until(ended)
    return reported[-1]


def press(device: Device, board: Board, *, full: bool = False) -> list[int]:
    """Write a force until most of its currents is given, or all of it; what is given then [mA]."""
    before = len(board.given)
    seen: list[int] = []

    def given() -> bool:
        device.read(CLOCK.now())
        device.write(PUSH)
        for each in board.given[before:]:  # there is none again where this loop has been late since
            seen[:] = each
            if seen == FULL if full else max(map(abs, seen)) >= 2300:
                return True
        return False

    until(given)
    return seen


@patch.object(arm, "GIVE_UP", 2.0)  # s; `test_arm.py` has that it is a quarter of a second
@patch.object(wooden_kind, "_FIRST_REPORT", 20.0)
def main() -> None:
    testbed, directory = load_umockdev().Testbed.new(), Path(sys.argv[1])
    generation, unit = sys.argv[2], directory / "unit.toml"
    unit.write_text("directions = [1, -1, -1]\n")
    options = f"board=auto,unit={unit}"
    seen: dict[str, object] = {"before": sentence_of(lambda: opened(options))}

    board = Board(testbed, directory, generation, 0)
    seen["unconfirmed"] = sentence_of(lambda: opened("board=auto"))
    other = "h2" if generation != "h2" else "h3"
    seen["other"] = sentence_of(lambda: opened(f"board={other},unit={unit}"))
    device = opened(options)
    seen["home"] = device.read(CLOCK.now()).position
    seen["pressed"] = press(device, board, full=True)
    board.button = True
    until(lambda: bool(device.read(CLOCK.now()).buttons) or generation == "h1")
    board.counts = (40, 0, 0)
    until(lambda: device.read(CLOCK.now()).position[0] > 0.0)
    seen["moved"] = device.read(CLOCK.now()).position
    until(lambda: tuple(board.currents) == (0, 0, 0))  # nobody wrote for a while
    seen["idle"] = True

    second = Board(testbed, directory, generation, 1)
    second.counts = (0, 50, 0)
    two = opened(f"number=2,{options}")
    press(device, board)
    seen["second_rests"] = tuple(second.currents) == ZERO
    press(two, second)

    second.counts = (30000, -30000, 12345)
    seen["garbage"] = end_of(two)
    second.counts = (0, 50, 0)
    drained = second.taken + 10  # of what is sent for ten commands no older one waits any more
    until(lambda: second.taken > drained)
    two.close()
    until(lambda: tuple(second.currents) == (0, 0, 0))
    two = opened(f"number=2,{options}")

    board.silent = True
    seen["stalled"] = end_of(device)
    until(lambda: tuple(board.currents) == (0, 0, 0) or not board.taken)
    device.close()
    seen["after_close"] = list(board.currents)
    board.unplug()
    second.unplug()
    seen["unplugged"] = end_of(two)
    two.close()
    print(json.dumps(seen))


if __name__ == "__main__":
    main()
