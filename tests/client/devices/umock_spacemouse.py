"""A SpaceMouse Compact made by umockdev, and the driver on it; prints the events as JSON.

Run by `test_spacemouse_hid.py` as `umockdev-wrapper python umock_spacemouse.py DIRECTORY`; the
directory is for a temporary file. Exit status 77 and a sentence: umockdev cannot be used here.

The device end is a pseudo-terminal, a stream of bytes without the borders of reports, so one report
is written at a time. Bursts are tested in `test_spacemouse.py`.
"""

from __future__ import annotations

import json
import os
import struct
import sys
from collections.abc import Callable
from pathlib import Path

from cohaptic.errors import DeviceError
from cohaptic_client.devices.device import DeviceSample
from cohaptic_client.devices.hid_devices import unknown_hid
from cohaptic_client.devices.spacemouse import SpaceMouse, find_mice, open_spacemouse
from tests.client.devices.umock import MockHid, load_umockdev, plug_in

CENTER = (0.0, 0.0, 0.0)
REACH = 0.1

# Two reports of three int16 each, -350 to 350, of a multi-axis controller: HID 1.11, section 6.2.2.
_AXES = "16 a2 fe  26 5e 01  75 10  95 03"  # logical limits, size of a report field, their number
DESCRIPTOR = bytes.fromhex(
    f"05 01  09 08  a1 01  {_AXES}"
    "  a1 00  85 01  09 30  09 31  09 32  81 02  c0"  # report 1: X Y Z
    "  a1 00  85 02  09 33  09 34  09 35  81 02  c0"  # report 2: Rx Ry Rz
    "  c0"
)
# Of a product that no list has: vendor and kind are enough.
MOUSE = MockHid(0x256F, 0xC6FF, "3Dconnexion", "SpaceMouse of tomorrow", DESCRIPTOR)
OTHER = MockHid(0x1209, 0xABCD, "Somebody", "Six Axes", DESCRIPTOR, number=1)
_KEYS = bytes.fromhex("05 01  09 06  a1 01  05 07  15 00  25 65  75 08  95 06  81 00  c0")
KEYBOARD = MockHid(0x1209, 0xBEEF, "Somebody", "Keys", _KEYS, number=2)


def sentence_of(action: Callable[[], object]) -> str:
    """Text of the DeviceError that `action` raises; empty without one."""
    try:
        action()
    except DeviceError as error:
        return str(error)
    return ""


def read_until_moved(mouse: SpaceMouse, velocity: tuple[float, ...], now: float) -> DeviceSample:
    """Read at one time until the velocity is new: the terminal may hand bytes on a little later."""
    for _ in range(100_000):
        sample = mouse.read(now)
        if sample.velocity != velocity:
            return sample
        os.sched_yield()
    raise TimeoutError("the report did not arrive")


def read_until_fresh(mouse: SpaceMouse, now: float) -> DeviceSample:
    """Read at one time until the cap is heard again."""
    for _ in range(100_000):
        sample = mouse.read(now)
        if sample.fresh:
            return sample
        os.sched_yield()
    raise TimeoutError("the report did not arrive")


def main() -> None:
    testbed = load_umockdev().Testbed.new()
    before = sentence_of(lambda: open_spacemouse(CENTER, reach=REACH))
    raw = plug_in(testbed, Path(sys.argv[1]), MOUSE)
    mouse = open_spacemouse(CENTER, reach=REACH)
    device_end = testbed.get_dev_fd(MOUSE.node)

    others = [plug_in(testbed, Path(sys.argv[1]), other) for other in (OTHER, KEYBOARD)]
    unknown = unknown_hid([found.where for found in find_mice()])
    for other in others:
        testbed.remove_device(other)

    rest = mouse.read(0.0)
    os.write(device_end, struct.pack("<B3h", 1, 350, -350, -350))
    moved = read_until_moved(mouse, rest.velocity, 0.0)
    held = mouse.read(0.01)
    # Nothing more is heard of the cap.
    gone = held
    for period in range(2, 100):
        gone = mouse.read(0.01 * period)
    os.write(device_end, struct.pack("<B3h", 1, 0, 0, 0))
    stopped = read_until_fresh(mouse, 1.0)

    os.close(device_end)
    unplugged = sentence_of(lambda: mouse.read(0.02))
    mouse.close()
    testbed.remove_device(raw)
    after = sentence_of(lambda: open_spacemouse(CENTER, reach=REACH))
    samples = {"rest": rest, "moved": moved, "held": held, "gone": gone, "stopped": stopped}
    print(
        json.dumps(
            {"before": before, "unplugged": unplugged, "after": after, "unknown": unknown}
            | {
                key: [sample.position, sample.velocity, sample.fresh]
                for key, sample in samples.items()
            }
        )
    )


if __name__ == "__main__":
    main()
