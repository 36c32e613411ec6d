"""A 3Dconnexion SpaceMouse as a device that only senses: it moves the tip and gives no force.

Rate control: the deflection of the cap is the velocity of the tip, because the cap travels by a
millimetre or two and a hand on a soft object by centimetres. Rotation and buttons are not used.
"""

from __future__ import annotations

import importlib
from typing import Protocol, TypedDict, cast

from cohaptic.errors import DeviceError
from cohaptic.vec import ZERO, Vec3
from cohaptic_client.devices.device import DeviceInfo, DeviceSample
from cohaptic_client.devices.spacemouse_reports import Motion, decode, without_dead_band

# By vendor. The first one is Logitech, whose other products are no SpaceMouse.
PRODUCTS = {
    0x046D: (0xC625, 0xC626, 0xC627, 0xC629, 0xC62B),
    0x256F: (0xC62E, 0xC632, 0xC633, 0xC635, 0xC638, 0xC63A, 0xC641, 0xC652),
}

_NAME = "spacemouse"
_LONGEST_REPORT = 64  # bytes; the most that full-speed USB allows
_MOST_REPORTS = 128  # per read; twice the queue of Linux, so that no device can hold the loop
_MAX_GAP = 0.02  # s; after a longer stall of the process the tip goes on from its last position
_MULTI_AXIS = (0x01, 0x08)  # HID usage page and usage: generic desktop, multi-axis controller
_UNKNOWN_USAGE = (0x00, 0x00)  # hidapi's libusb backend does not look


class Transport(Protocol):
    """An open HID device in non-blocking mode, as hidapi offers it."""

    def read(self, max_length: int, /) -> list[int]:
        """The next report, empty when there is none; raises OSError when the device is gone."""
        ...

    def close(self) -> object:
        """Release the device."""
        ...


class SpaceMouse:
    """The tip of a SpaceMouse in a cube of the world.

    Its cap starts at rest, and the tip in the middle of the cube's face that is nearest to the
    user: the body to be touched is round `center`, and a tip that starts in it would be pressed.

    Args:
        transport: The open device; this object closes it.
        center: Of the cube [m].
        reach: Half the edge of the cube [m].
        max_speed: Of the tip along each axis, at full deflection [m/s].
    """

    info = DeviceInfo(_NAME, max_force=0.0, max_stiffness=1000.0)

    def __init__(
        self, transport: Transport, center: Vec3, *, reach: float, max_speed: float = 0.15
    ) -> None:
        self._transport = transport
        self._low = (center[0] - reach, center[1] - reach, center[2] - reach)
        self._high = (center[0] + reach, center[1] + reach, center[2] + reach)
        self._max_speed = max_speed
        self._position: Vec3 = (center[0], self._low[1], center[2])
        self._deflection = ZERO
        self._now: float | None = None
        self._closed = False
        self._skipped = 0

    @property
    def skipped(self) -> int:
        """Deflections that were never used, because a newer one had come."""
        return self._skipped

    def read(self, now: float) -> DeviceSample:
        """Move the tip up to `now` with the newest deflection; without a new one the last holds.

        Raises:
            DeviceError: The device was unplugged or is closed.
        """
        self._drain()
        dt = 0.0 if self._now is None else max(0.0, min(now - self._now, _MAX_GAP))
        self._now = now
        (x, vx), (y, vy), (z, vz) = (self._move(axis, dt) for axis in range(3))
        self._position = (x, y, z)
        return DeviceSample(self._position, (vx, vy, vz))

    def write(self, force: Vec3) -> None:
        """Nothing: the device has no motors, so the hand never feels `force` [N]."""

    def close(self) -> None:
        """Release the hardware; may be called twice."""
        if not self._closed:
            self._closed = True
            self._transport.close()

    def _move(self, axis: int, dt: float) -> tuple[float, float]:
        """Position [m] and velocity [m/s] along an axis after `dt`; a wall stops the tip."""
        velocity = self._max_speed * self._deflection[axis]
        position = self._position[axis] + velocity * dt
        low, high = self._low[axis], self._high[axis]
        if position <= low and velocity < 0.0:
            return low, 0.0
        if position >= high and velocity > 0.0:
            return high, 0.0
        return position, velocity

    def _drain(self) -> None:
        """Take the newest of the deflections that have come; the queue may hold stale ones."""
        newest: Vec3 | None = None
        for _ in range(_MOST_REPORTS):
            report = self._next_report()
            if not report:
                break
            event = decode(report)
            if isinstance(event, Motion) and event.translation is not None:
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
        center: Of the cube in which the tip moves [m].
        reach: Half the edge of that cube [m].
        max_speed: Of the tip along each axis, at full deflection [m/s].

    Raises:
        DeviceError: hidapi is missing, there is no SpaceMouse, or it may not be opened.
    """
    hid = _hidapi()
    entries = [e for vendor in PRODUCTS for e in hid.enumerate(vendor) if _is_spacemouse(e)]
    if not entries:
        advice = "plug one in (a wireless one: its receiver or its cable)"
        raise DeviceError(_NAME, "no SpaceMouse was found", advice)
    device = hid.device()
    for entry in entries:
        try:
            device.open_path(entry["path"])
        except OSError:  # hidapi says no more than "open failed"
            continue
        device.set_nonblocking(1)
        return SpaceMouse(device, center, reach=reach, max_speed=max_speed)
    vendor = entries[0]["vendor_id"]
    rule = f'KERNEL=="hidraw*", ATTRS{{idVendor}}=="{vendor:04x}", TAG+="uaccess"'
    raise DeviceError(
        _NAME,
        "a SpaceMouse was found but could not be opened",
        f"on Linux put the line {rule} into /etc/udev/rules.d/70-cohaptic.rules and plug it in "
        "again; elsewhere quit other programs that use it",
    )


class _Entry(TypedDict):
    path: bytes
    vendor_id: int
    product_id: int
    usage_page: int
    usage: int


class _HidDevice(Transport, Protocol):
    def open_path(self, path: bytes, /) -> object: ...

    def set_nonblocking(self, on: int, /) -> object: ...


class _Hidapi(Protocol):
    def enumerate(self, vendor_id: int, /) -> list[_Entry]: ...

    def device(self) -> _HidDevice: ...


def _is_spacemouse(entry: _Entry) -> bool:
    """Whether a HID interface is the cap of a SpaceMouse, not a receiver's keyboard or mouse."""
    usage = (entry["usage_page"], entry["usage"])
    known = entry["product_id"] in PRODUCTS.get(entry["vendor_id"], ())
    return known and usage in (_MULTI_AXIS, _UNKNOWN_USAGE)


def _hidapi() -> _Hidapi:
    """The module of hidapi, imported only when a device is to be opened.

    On Linux its wheel has two: `hidraw` shares the device with the kernel's drivers and sees
    Bluetooth; `hid` does neither. Other systems have `hid` only. A different package from PyPI is
    called `hid`, too, and wins that name when both are installed.
    """
    for name in ("hidraw", "hid"):
        try:
            module = importlib.import_module(name)
        except (ImportError, OSError):  # the other `hid` needs a library of the system
            continue
        if hasattr(module, "device"):
            return cast(_Hidapi, module)
    problem = "the Python package hidapi is missing, or hidden by the package hid"
    advice = "run: pip uninstall -y hid; pip install --force-reinstall hidapi"
    raise DeviceError(_NAME, problem, advice)
