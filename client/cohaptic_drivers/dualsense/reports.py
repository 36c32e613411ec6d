"""Pure functions that decode and encode the reports of a DualSense over USB."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from cohaptic.errors import DeviceError

NAME = "dualsense"
SIZE = 64  # bytes of a report from the pad
OUTPUT_SIZE = 48  # bytes of a report to the pad; the kernel sends 63, and the pad takes both
LARGEST = 255  # full scale of each byte with a pull, a stick, a resistance or a rumble

_USB, _BLUETOOTH = 0x01, 0x31  # ids of reports from the pad
_OUTPUT = 0x02  # id of a report to the pad
_RUMBLE = 0x01 | 0x02  # flags: the report sets the rumble, and the motors do it
_RIGHT_MOTOR, _LEFT_MOTOR = 3, 4  # bytes of the small motor and of the big one
_OFF, _RESISTANCE = 0x05, 0x01  # modes of a trigger
_CENTRE = 128  # approximate centre of a stick


@dataclass(frozen=True, slots=True)
class Side:
    """Positions of the bytes and flags of one trigger in the reports.

    Args:
        name: Name of the trigger, as the user types it.
        analog: Index of the byte with the trigger's pull, in a report from the pad.
        flag: Flag by which a report to the pad says that it changes this trigger.
        block: Index of the first byte of the trigger's effect, in a report to the pad.
    """

    name: str
    analog: int
    flag: int
    block: int


SIDES = {
    "right": Side("right", analog=6, flag=0x04, block=11),
    "left": Side("left", analog=5, flag=0x08, block=22),
}


@dataclass(frozen=True, slots=True)
class Held:
    """State of sticks, trigger and buttons in one report.

    Args:
        left: Left stick, to the right and up, each -1 to 1.
        right: Right stick, to the right and up, each -1 to 1.
        pull: Pull of the trigger, 0 to 255.
        buttons: A bit for each pressed button: square, cross, circle, triangle, then the buttons of
            the next two bytes.
    """

    left: tuple[float, float]
    right: tuple[float, float]
    pull: int
    buttons: int = 0


@dataclass(frozen=True, slots=True)
class Effects:
    """Effects of the pad on the hands.

    Args:
        start: Pull at which the trigger begins to resist, 0 to 255.
        resistance: Resistance of the trigger from that pull on, 0 to 255; it has not been measured
            in newtons.
        rumble: Rumble of both motors, 0 to 255.
    """

    start: int = 0
    resistance: int = 0
    rumble: int = 0


OFF = Effects()


def decode(report: Iterable[int], side: Side) -> Held | None:
    """Decode a report; return None for one that is unknown, truncated or not made of bytes.

    Raises:
        DeviceError: The pad has sent a report of its Bluetooth mode.
    """
    try:
        data = bytes(report)
    except ValueError:  # a number that is not a byte
        return None
    if data and data[0] == _BLUETOOTH:
        raise wireless()
    if len(data) != SIZE or data[0] != _USB:
        return None
    buttons = data[8] >> 4 | data[9] << 4 | (data[10] & 0b111) << 12
    left, right = (
        (_fraction(data[1]), -_fraction(data[2])),
        (_fraction(data[3]), -_fraction(data[4])),
    )
    return Held(left, right, data[side.analog], buttons)


def encode(effects: Effects, side: Side) -> bytes:
    """Encode a report with these effects; it leaves the other trigger and the lights unchanged."""
    data = bytearray(OUTPUT_SIZE)
    data[0], data[1] = _OUTPUT, _RUMBLE | side.flag
    data[_RIGHT_MOTOR] = data[_LEFT_MOTOR] = _byte(effects.rumble)
    resistance = _byte(effects.resistance)
    data[side.block] = _RESISTANCE if resistance else _OFF
    if resistance:
        data[side.block + 1 : side.block + 3] = bytes([_byte(effects.start), resistance])
    return bytes(data)


def wireless() -> DeviceError:
    """Make the error for a pad on Bluetooth, whose reports have another layout and a checksum."""
    return DeviceError(NAME, "it is connected by Bluetooth", "connect it by cable")


def _fraction(raw: int) -> float:
    return max(-1.0, min(1.0, (raw - _CENTRE) / (LARGEST - _CENTRE)))


def _byte(value: int) -> int:
    return max(0, min(LARGEST, value))
