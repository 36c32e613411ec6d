"""Devices that umockdev mocks, for scripts that run under `umockdev-wrapper`."""

from __future__ import annotations

import importlib
import struct
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

UNAVAILABLE = 77  # the status by which automake's tests say "skipped"


@dataclass(frozen=True, slots=True)
class MockHid:
    """A HID device of one interface.

    Args:
        vendor: USB id.
        product: USB id.
        maker: Name of its maker.
        name: Of the product.
        descriptor: Of its reports.
        number: Of its hidraw node.
        serial: Its number, as text.
    """

    vendor: int
    product: int
    maker: str
    name: str
    descriptor: bytes
    number: int = 0
    serial: str = ""

    @property
    def node(self) -> str:
        return f"/dev/hidraw{self.number}"


def load_umockdev() -> Any:
    # The system's `gi` is no wheel. Appended, so that nothing else of the system hides ours.
    sys.path.append("/usr/lib/python3/dist-packages")
    try:
        gi: Any = importlib.import_module("gi")
        gi.require_version("UMockdev", "1.0")
        return importlib.import_module("gi.repository.UMockdev")
    except (ImportError, ValueError) as error:
        version = f"{sys.version_info.major}.{sys.version_info.minor}"
        print(f"umockdev cannot be used from Python {version}: {error}")
        sys.exit(UNAVAILABLE)


def plug_in(testbed: Any, directory: Path, mock: MockHid) -> str:
    """Add the device as Linux shows it, and return the path of its hidraw node in sysfs."""
    port, ids = f"1-{mock.number + 1}", (f"{mock.vendor:04x}", f"{mock.product:04x}")
    attributes = ["idVendor", ids[0], "idProduct", ids[1], "bcdDevice", "0431"]
    attributes += ["serial", mock.serial, "manufacturer", mock.maker, "product", mock.name]
    usb = testbed.add_device("usb", port, None, attributes, ["DEVTYPE", "usb_device"])
    interface = testbed.add_device(
        "usb", f"{port}:1.0", usb, ["bInterfaceNumber", "00"], ["DEVTYPE", "usb_interface"]
    )
    hid_id = f"0003:0000{ids[0].upper()}:0000{ids[1].upper()}"
    identity = ["HID_ID", hid_id, "HID_NAME", f"{mock.maker} {mock.name}"]
    identity += ["HID_UNIQ", mock.serial]
    named = f"0003:{ids[0].upper()}:{ids[1].upper()}.{mock.number + 1:04x}"
    hid = testbed.add_device("hid", named, interface, [], identity)
    testbed.set_attribute_binary(hid, "report_descriptor", mock.descriptor)
    raw = f"{hid}/hidraw/hidraw{mock.number}"
    testbed.add_from_string(
        f"P: {raw.removeprefix('/sys')}\n"
        f"N: hidraw{mock.number}\n"
        f"E: DEVNAME={mock.node}\nE: SUBSYSTEM=hidraw\nE: MAJOR=240\nE: MINOR={mock.number}\n"
        f"A: dev=240:{mock.number}\n"
        f"L: device=../../../{hid.rpartition('/')[2]}\n"
    )
    size = struct.pack("<I", len(mock.descriptor))
    ioctls = directory / f"ioctls{mock.number}"
    ioctls.write_text(
        f"@DEV {mock.node}\n"
        f"HIDIOCGRDESCSIZE 0 {size.hex().upper()}\n"
        f"HIDIOCGRDESC 0 {(size + mock.descriptor.ljust(4096, bytes(1))).hex().upper()}\n"
    )
    testbed.load_ioctl(mock.node, str(ioctls))
    return str(raw)
