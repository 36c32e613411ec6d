"""Finds drivers by name, and imports only the driver of the chosen device.

The drivers for everybody and those for scripts are in this folder; packages such as
`cohaptic_drivers` add all others by entry points.
"""

from __future__ import annotations

from functools import lru_cache
from importlib import import_module
from typing import cast

from cohaptic.errors import CohapticError, DeviceError, SettingError
from cohaptic.extensions import OURS, ExtensionError, added, adder, load
from cohaptic_client.devices.device import Device, DeviceInfo
from cohaptic_client.devices.kind import DeviceChoice, DeviceConfig, DeviceKind, Found, split_choice

GROUP = "cohaptic.devices"  # group of the entry points, each of which names a `DeviceKind`
# Module that defines the `KIND` of each device in this folder.
_HERE = {
    "simulated": "cohaptic_client.devices.simulated",
    "spacemouse": "cohaptic_client.devices.spacemouse",
}
# Those that only a script chooses, so that no list for users has them.
_OF_SCRIPTS = {
    "passed": "cohaptic_client.devices.passed",
    "scripted": "cohaptic_client.devices.scripted",
}


def names() -> list[str]:
    """Return the names of all devices, the simulated one first."""
    return ["simulated", *sorted({*_HERE, *added(GROUP)} - {"simulated"})]


def device_kind(name: str) -> DeviceKind:
    """Return the driver with this name.

    Raises:
        SettingError: There is no such driver; the error lists the names that exist.
        ExtensionError: The package that adds the driver is broken.
    """
    if module := _HERE.get(name) or _OF_SCRIPTS.get(name):
        return cast(DeviceKind, import_module(module).KIND)
    if name not in added(GROUP):
        raise SettingError("device", repr(name), f"one of: {', '.join(names())}")
    return load(GROUP, name, DeviceKind)


def read_device(text: str) -> DeviceChoice:
    """Read a text such as `NAME:KEY=VALUE`; raise SettingError if the text is not valid."""
    name, options = split_choice(text)
    return device_kind(name).choice(options)


# Cached, because a status asks for it ten times a second, and an option may name a file.
@lru_cache(16)
def device_info(choice: DeviceChoice) -> DeviceInfo:
    """Return the abilities of a device without opening it; raise SettingError as `read_device`."""
    return device_kind(choice.name).info(choice)


def open_device(config: DeviceConfig) -> Device:
    """Open the device of a configuration; raise DeviceError if it cannot be opened."""
    name = config.choice.name
    try:
        return device_kind(name).open(config)
    except CohapticError:
        raise
    except Exception as error:  # a foreign driver may raise anything; the user gets one sentence
        if name in _HERE or name in _OF_SCRIPTS or adder(GROUP, name) == OURS:
            raise
        raise DeviceError(name, f"its driver failed ({error})") from error


def search() -> tuple[list[Found], list[DeviceError]]:
    """Search this machine; return the devices, and the errors of drivers that failed to search."""
    found: list[Found] = []
    missing: list[DeviceError] = []
    for name in names():
        try:
            found += device_kind(name).find()
        except DeviceError as error:
            missing.append(error)
        except ExtensionError as error:
            missing.append(DeviceError(name, error.problem, f"install {error.package} anew"))
        except Exception as error:  # a failing foreign driver must not stop the search of others
            if name in _HERE or adder(GROUP, name) == OURS:
                raise
            missing.append(DeviceError(name, f"its driver failed ({error})"))
    return found, missing
