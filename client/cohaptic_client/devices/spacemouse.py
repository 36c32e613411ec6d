"""A 3Dconnexion SpaceMouse as a device without motors: it moves the tip and gives no force.

Pure functions decode a report: its bytes give the deflections of the cap in the world frame. The
raw axes point right, toward the user and down; those of cohaptic point right, away from the user
and up.

The device uses rate control: the deflection of the cap sets the velocity of the tip, because the
cap moves by one or two millimetres, but a hand on a soft object by centimetres. Rotation and
buttons are not used.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Protocol

from cohaptic.errors import DeviceError
from cohaptic.vec import ZERO, Vec3
from cohaptic_client.devices.device import DeviceInfo, DeviceSample
from cohaptic_client.devices.hid_devices import Entry, hidapi, open_first, try_hid
from cohaptic_client.devices.kind import DeviceChoice, DeviceConfig, DeviceKind, Found
from cohaptic_client.devices.placing.options import PLACING_OPTIONS, scale_of, turn_of
from cohaptic_client.devices.placing.placed import Placed
from cohaptic_client.devices.placing.workspace import Workspace

FULL_SCALE = 350  # counts; logical maximum in the report descriptors, which some units exceed
DEAD_BAND = 0.03  # share of full scale; an untouched cap may rest a few counts off zero

_TRANSLATION, _ROTATION, _BUTTONS = 1, 2, 3  # report ids
_SHORT = 7  # bytes: id and three int16
_LONG = 13  # bytes: id and six int16


@dataclass(frozen=True, slots=True)
class Motion:
    """Deflection of the cap in one report.

    Args:
        translation: Deflection along x, y, z of the world, each -1 to 1 of full scale; None if not
            reported.
        rotation: Deflection about x, y, z of the world, each -1 to 1 of full scale; None if not
            reported.
    """

    translation: Vec3 | None
    rotation: Vec3 | None


@dataclass(frozen=True, slots=True)
class Buttons:
    """The pressed buttons in one report.

    Args:
        pressed: One bit for each button; bit b of byte n of the report is bit 8 (n - 1) + b.
    """

    pressed: int


def decode(report: Iterable[int]) -> Motion | Buttons | None:
    """Decode a report; return None for one that is unknown, truncated or not made of bytes.

    Older devices send translation and rotation as two reports, newer devices send both in one long
    report. The length tells them apart; a list of product ids would lack those of future devices.
    """
    try:
        data = bytes(report)
    except ValueError:  # a number that is not a byte
        return None
    kind = data[0] if data else None
    if kind == _TRANSLATION and len(data) >= _LONG:
        return Motion(_deflection(data, 1), _deflection(data, 7))
    if kind == _TRANSLATION and len(data) >= _SHORT:
        return Motion(_deflection(data, 1), None)
    if kind == _ROTATION and len(data) >= _SHORT:
        return Motion(None, _deflection(data, 1))
    if kind == _BUTTONS and len(data) >= 2:
        return Buttons(int.from_bytes(data[1:], "little"))
    return None


def without_dead_band(deflection: Vec3) -> Vec3:
    """Set small deflections to 0, up to `DEAD_BAND` on each axis; from there on scale linearly."""
    x, y, z = deflection
    return (_rescale(x), _rescale(y), _rescale(z))


def _rescale(value: float) -> float:
    beyond = abs(value) - DEAD_BAND
    return math.copysign(beyond / (1.0 - DEAD_BAND), value) if beyond > 0.0 else 0.0


def _deflection(data: bytes, start: int) -> Vec3:
    x, y, z = (
        int.from_bytes(data[i : i + 2], "little", signed=True) for i in range(start, start + 6, 2)
    )
    return (_fraction(x), _fraction(-y), _fraction(-z))


def _fraction(counts: int) -> float:
    return max(-1.0, min(1.0, counts / FULL_SCALE))


# USB ids of 3Dconnexion, and of Logitech, which made the older devices.
VENDORS = (0x256F, 0x046D)

_NAME = "spacemouse"
_LONGEST_REPORT = 64  # bytes; the most that full-speed USB allows
_MAX_REPORTS = 128  # per read; twice Linux's queue; a limit, so that no device holds up the loop
_MAX_GAP = 0.02  # s; after a longer stall of the process the tip goes on from its last position
_MULTI_AXIS = (0x01, 0x08)  # HID usage page and usage: generic desktop, multi-axis controller
_UNKNOWN_USAGE = (0x00, 0x00)  # hidapi's libusb backend does not read the usage
_OF_LOGITECH = range(0xC621, 0xC62C)  # SpaceMice among Logitech's product ids, for unknown usages
# s; a deflected cap reports all the time, and a cap at rest does not report
_SILENCE = 0.2


class Transport(Protocol):
    """An open HID device in non-blocking mode, as hidapi offers it."""

    def read(self, max_length: int, /) -> list[int]:
        """Return the next report, or an empty list; raise OSError when the device is gone."""
        ...

    def close(self) -> object:
        """Release the device."""
        ...


class SpaceMouse:
    """A tip that the cap of a SpaceMouse moves within a cube of the world.

    The cap starts at rest, and the tip starts in the middle of the cube's face that is nearest to
    the user. The body lies round `center`: a tip that started inside the body would press on it.

    Args:
        transport: The open device; this object closes it.
        center: Centre of the cube [m].
        reach: Half the edge of the cube [m].
        max_speed: Largest speed of the tip along each axis, at full deflection [m/s].
    """

    info = DeviceInfo(_NAME, max_force=0.0, max_stiffness=1000.0, force_axes=0)

    def __init__(
        self, transport: Transport, center: Vec3, *, reach: float, max_speed: float = 0.15
    ) -> None:
        self._transport = transport
        self._low = (center[0] - reach, center[1] - reach, center[2] - reach)
        self._high = (center[0] + reach, center[1] + reach, center[2] + reach)
        self._max_speed = max_speed
        self._position: Vec3 = (center[0], self._low[1], center[2])
        self._deflection = ZERO
        self._silent = 0.0  # since the last report of a deflection, while the process ran [s]
        self._now: float | None = None
        self._closed = False
        self._skipped = 0

    @property
    def skipped(self) -> int:
        """Number of deflections that were skipped, because a newer one had arrived."""
        return self._skipped

    def read(self, now: float) -> DeviceSample:
        """Move the tip up to time `now` [s] with the newest deflection; return its state.

        Without a new report the last deflection stays in use for `_SILENCE`, and then the tip
        stands still: otherwise a cap that is out of reach or asleep would move it for ever.

        Raises:
            DeviceError: The device was unplugged or is closed.
        """
        dt = 0.0 if self._now is None else max(0.0, min(now - self._now, _MAX_GAP))
        self._now = now
        self._silent += dt
        self._drain()
        gone = self._deflection != ZERO and self._silent > _SILENCE
        if gone:
            dt = 0.0
        (x, vx), (y, vy), (z, vz) = (self._move(axis, dt) for axis in range(3))
        self._position = (x, y, z)
        return DeviceSample(self._position, ZERO if gone else (vx, vy, vz), fresh=not gone)

    def write(self, force: Vec3) -> None:
        """Do nothing: the device has no motors, so the hand never feels `force` [N]."""

    def release(self) -> None:
        """Do nothing: the device has no motors."""

    def close(self) -> None:
        """Release the hardware; may be called twice."""
        if not self._closed:
            self._closed = True
            self._transport.close()

    def _move(self, axis: int, dt: float) -> tuple[float, float]:
        """Return position [m] and velocity [m/s] on an axis after `dt` [s]; walls stop the tip."""
        velocity = self._max_speed * self._deflection[axis]
        position = self._position[axis] + velocity * dt
        low, high = self._low[axis], self._high[axis]
        if position <= low and velocity < 0.0:
            return low, 0.0
        if position >= high and velocity > 0.0:
            return high, 0.0
        return position, velocity

    def _drain(self) -> None:
        """Read the queued reports; use the newest deflection, and count the others as skipped."""
        newest: Vec3 | None = None
        for _ in range(_MAX_REPORTS):
            report = self._next_report()
            if not report:
                break
            event = decode(report)
            if isinstance(event, Motion) and event.translation is not None:
                self._silent = 0.0
                self._skipped += newest is not None
                newest = event.translation
        if newest is not None:
            self._deflection = without_dead_band(newest)

    def _next_report(self) -> list[int]:
        if self._closed:
            raise DeviceError(_NAME, "it is closed", "open it again")
        try:
            return self._transport.read(_LONGEST_REPORT)
        except OSError as error:
            advice = "plug it in again (a wireless one: switch it on), then start again"
            raise DeviceError(_NAME, f"it was unplugged ({error})", advice) from error


def open_spacemouse(center: Vec3, *, reach: float, max_speed: float = 0.15) -> SpaceMouse:
    """Find and open the first SpaceMouse of this computer.

    Args:
        center: Centre of the cube in which the tip moves [m].
        reach: Half the edge of that cube [m].
        max_speed: Largest speed of the tip along each axis, at full deflection [m/s].

    Raises:
        DeviceError: hidapi is missing, there is no SpaceMouse, or this user may not open it.
    """
    entries = _mice()
    if not entries:
        advice = "plug one in (a wireless one: its receiver or its cable)"
        raise DeviceError(_NAME, "no SpaceMouse was found", advice)
    device, _ = open_first(_NAME, "a SpaceMouse", entries)
    return SpaceMouse(device, center, reach=reach, max_speed=max_speed)


def _info(choice: DeviceChoice) -> DeviceInfo:
    scale_of(choice)
    turn_of(choice)
    return SpaceMouse.info


def _open(config: DeviceConfig) -> Placed:
    """Open the first SpaceMouse in a cube of twice the body's size; `scale` sets only its speed."""
    scale = scale_of(config.choice)
    mouse = open_spacemouse(center=ZERO, reach=2.0 * config.radius / scale)
    return Placed(mouse, Workspace(ZERO, config.center, scale, turn_of(config.choice)))


def find_mice() -> list[Found]:
    """Return the SpaceMice of this machine; raise DeviceError without hidapi."""
    found = list[Found]()
    for entry in _mice():
        where = f"{entry['product_string']} at {entry['path'].decode(errors='replace')}"
        found.append(try_hid(_NAME, _NAME, where, entry))
    return found


KIND = DeviceKind(
    _NAME,
    "a 3Dconnexion SpaceMouse, which only senses",
    PLACING_OPTIONS[:2],
    _info,
    _open,
    find_mice,
)


def _mice() -> list[Entry]:
    """List the HID interfaces of SpaceMouse caps; raise DeviceError without hidapi."""
    hid = hidapi(_NAME)
    return [entry for vendor in VENDORS for entry in hid.enumerate(vendor) if _is_cap(entry)]


def _is_cap(entry: Entry) -> bool:
    """Return whether a HID interface is a SpaceMouse's cap, not a receiver's keyboard or mouse."""
    usage = (entry["usage_page"], entry["usage"])
    if usage == _UNKNOWN_USAGE:
        return entry["vendor_id"] == VENDORS[0] or entry["product_id"] in _OF_LOGITECH
    return usage == _MULTI_AXIS
