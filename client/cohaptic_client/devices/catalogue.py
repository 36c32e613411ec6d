"""Devices by name. A driver is imported when it is chosen, and no other is."""

from __future__ import annotations

from functools import lru_cache
from importlib import import_module
from typing import cast

from cohaptic.errors import DeviceError, SettingError
from cohaptic_client.devices.choice import DeviceChoice, split_choice
from cohaptic_client.devices.device import Device, DeviceInfo
from cohaptic_client.devices.device_config import DeviceConfig
from cohaptic_client.devices.kind import DeviceKind, Found

# The module that has the `KIND` of each name. The next device is one line here.
_HOMES = {
    "simulated": "cohaptic_client.devices.simulated_kind",
    "dualsense": "cohaptic_client.devices.dualsense.dualsense_kind",
    "forcedimension": "cohaptic_client.devices.vendor.forcedimension",
    "haply": "cohaptic_client.devices.haply.inverse3",
    "oneaxis": "cohaptic_client.devices.oneaxis.oneaxis_kind",
    "spacemouse": "cohaptic_client.devices.spacemouse",
    "touch": "cohaptic_client.devices.vendor.touch",
    "woodenhaptics": "cohaptic_client.devices.woodenhaptics.wooden_kind",
}

NAMES = tuple(_HOMES)


def device_kind(name: str) -> DeviceKind:
    """The driver called `name`; raises SettingError with the names that exist."""
    if name not in _HOMES:
        raise SettingError("device", repr(name), f"one of: {', '.join(NAMES)}")
    return cast(DeviceKind, import_module(_HOMES[name]).KIND)


def read_device(text: str) -> DeviceChoice:
    """The choice in a text such as `NAME:KEY=VALUE`; raises SettingError with what exists."""
    name, options = split_choice(text)
    return device_kind(name).choice(options)


# A status asks for it ten times a second, and an option may name a file.
@lru_cache(16)
def device_info(choice: DeviceChoice) -> DeviceInfo:
    """Abilities of a device without having it; raises SettingError as `read_device` does."""
    return device_kind(choice.name).info(choice)


def open_device(config: DeviceConfig) -> Device:
    """Open the device of a configuration; raises DeviceError when it cannot be had."""
    return device_kind(config.choice.name).open(config)


def search() -> tuple[list[Found], list[DeviceError]]:
    """Devices of this machine, and what was missing to look for others."""
    found: list[Found] = []
    missing: list[DeviceError] = []
    for name in NAMES:
        try:
            found += device_kind(name).find()
        except DeviceError as error:
            missing.append(error)
    return found, missing
