"""Access to HID devices through hidapi, which is imported only on use, and advice on errors."""

from __future__ import annotations

import importlib
from collections.abc import Iterable
from typing import NotRequired, Protocol, TypedDict, cast

from cohaptic.errors import DeviceError
from cohaptic_client.devices.kind import Found

# Usage pages and usages of HID: devices that move something (joystick, gamepad, multi-axis
# controller, force feedback), and devices of a desk: mouse, keyboard, keypad and media keys.
_MOVES = ((0x01, 0x04), (0x01, 0x05), (0x01, 0x08))
_FORCE_FEEDBACK, _OF_A_VENDOR, _NOT_REPORTED = 0x0F, 0xFF00, 0x00
_OF_A_DESK = ((0x01, 0x02), (0x01, 0x06), (0x01, 0x07), (0x0C, 0x01))


class Entry(TypedDict):
    """A HID interface of this machine, as hidapi lists it."""

    path: bytes
    vendor_id: int
    product_id: int
    product_string: str
    serial_number: str
    usage_page: int
    usage: int
    interface_number: int
    bus_type: NotRequired[int]  # 1 is USB, 2 is Bluetooth


class HidDevice(Protocol):
    """A HID device, as hidapi offers it."""

    def open_path(self, path: bytes, /) -> object:
        """Open the device at a path; raise OSError if that fails."""
        ...

    def set_nonblocking(self, on: int, /) -> object:
        """Set whether `read` without a time-out returns at once, even without a report."""
        ...

    def read(self, max_length: int, timeout_ms: int = 0, /) -> list[int]:
        """Return the next report, or an empty list; raise OSError when the device is gone."""
        ...

    def write(self, report: bytes, /) -> int:
        """Send a report that begins with its id; return -1 on failure."""
        ...

    def get_report_descriptor(self) -> list[int]:
        """Return the HID report descriptor: the layout of the device's reports."""
        ...

    def close(self) -> object:
        """Release the device."""
        ...


class Hidapi(Protocol):
    """Those functions of the hidapi module that the drivers use."""

    def enumerate(self, vendor_id: int = 0, product_id: int = 0, /) -> list[Entry]:
        """List the HID interfaces of a vendor and a product; 0 stands for any."""
        ...

    def device(self) -> HidDevice:
        """Make a device object that is not yet open."""
        ...


def hidapi(name: str) -> Hidapi:
    """Import hidapi and return its module.

    On Linux the wheel of hidapi has two modules: `hidraw` shares the device with the kernel's
    drivers and sees Bluetooth; `hid` does neither. Other systems have `hid` only. A different
    package from PyPI is also called `hid`, and hides this module when both are installed.

    Args:
        name: Name of the device, for the error.

    Raises:
        DeviceError: The module is missing or hidden.
    """
    for module_name in ("hidraw", "hid"):
        try:
            module = importlib.import_module(module_name)
        except (ImportError, OSError):  # the other `hid` needs a library of the system
            continue
        if hasattr(module, "device"):
            return cast(Hidapi, module)
    problem = "the Python package hidapi is missing, or hidden by the package hid"
    advice = "run: pip uninstall -y hid; pip install --force-reinstall hidapi"
    raise DeviceError(name, problem, advice)


def try_hid(name: str, choice: str, where: str, entry: Entry) -> Found:
    """Open a HID interface and close it again, to find out whether it can be used.

    Args:
        name: Name of the device, for errors.
        choice: Text after `--device` that chooses the device.
        where: Description for the user of where the device was found.

    Returns:
        The device as found, with a problem if it could not be opened.
    """
    try:
        device, _ = open_first(name, "it", [entry])
    except DeviceError as error:
        return Found(choice, where, "it could not be opened", error.advice)
    device.close()
    return Found(choice, where)


def unknown_hid(known: Iterable[str]) -> list[str]:
    """List HID devices that may be haptic or control motion, and that no driver has found.

    Args:
        known: `Found.where` of the devices that drivers have found; each text ends with the path.

    Raises:
        DeviceError: hidapi is missing.
    """
    places = tuple(known)
    entries = hidapi("HID devices").enumerate()
    desk = {_product(entry) for entry in entries if _usage(entry) in _OF_A_DESK}
    others = dict[str, str]()
    for entry in entries:
        path = entry["path"].decode(errors="replace")
        page = entry["usage_page"]
        special = page in (_FORCE_FEEDBACK, _NOT_REPORTED) or page >= _OF_A_VENDOR
        moves = _usage(entry) in _MOVES or (special and _product(entry) not in desk)
        if moves and not any(place.endswith(path) for place in places):
            vendor, product = _product(entry)
            others[path] = f"{vendor:04x}:{product:04x} {entry['product_string']} at {path}"
    return list(others.values())


def _usage(entry: Entry) -> tuple[int, int]:
    return entry["usage_page"], entry["usage"]


def _product(entry: Entry) -> tuple[int, int]:
    return entry["vendor_id"], entry["product_id"]


def udev_rule(vendor: int) -> str:
    """Return the Linux udev rule that lets a person at the machine use a vendor's HID devices."""
    return f'KERNEL=="hidraw*", ATTRS{{idVendor}}=="{vendor:04x}", TAG+="uaccess"'


def open_first(name: str, what: str, entries: Iterable[Entry]) -> tuple[HidDevice, Entry]:
    """Open the first device that can be opened, in non-blocking mode; return it and its interface.

    Args:
        name: Name of the device, for errors.
        what: Description of the device for errors, such as "a SpaceMouse".
        entries: Interfaces to try; at least one.

    Raises:
        DeviceError: None of the interfaces can be opened.
    """
    vendor = 0
    for entry in entries:
        vendor = entry["vendor_id"]
        # A new object for each attempt, because hidapi does not close a device that failed to open.
        device = hidapi(name).device()
        try:
            device.open_path(entry["path"])
        except OSError:  # the message says only "open failed"
            continue
        device.set_nonblocking(1)
        return device, entry
    raise DeviceError(
        name,
        f"{what} was found but could not be opened",
        f"on Linux put the line {udev_rule(vendor)} into /etc/udev/rules.d/70-cohaptic.rules and "
        "plug it in again; elsewhere quit other programs that use it",
    )
