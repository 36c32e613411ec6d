"""Devices by name. A driver is imported when it is chosen, and no other is.

Two are here; all others are added by packages, `cohaptic_drivers` among them.
"""

from __future__ import annotations

from functools import lru_cache
from importlib import import_module
from typing import cast

from cohaptic.errors import CohapticError, DeviceError, SettingError
from cohaptic.extensions import OURS, ExtensionError, added, adder, load
from cohaptic_client.devices.choice import DeviceChoice, split_choice
from cohaptic_client.devices.device import Device, DeviceInfo
from cohaptic_client.devices.device_config import DeviceConfig
from cohaptic_client.devices.kind import DeviceKind, Found

GROUP = "cohaptic.devices"  # of entry points, each a `DeviceKind`
# The module that has the `KIND` of each that is here.
_HERE = {
    "simulated": "cohaptic_client.devices.simulated_kind",
    "spacemouse": "cohaptic_client.devices.spacemouse",
}


def names() -> list[str]:
    """Names of all devices, the simulated one first."""
    return ["simulated", *sorted({*_HERE, *added(GROUP)} - {"simulated"})]


def device_kind(name: str) -> DeviceKind:
    """The driver called `name`.

    Raises:
        SettingError: There is none; the error has the names that exist.
        ExtensionError: The package that adds it is broken.
    """
    if name in _HERE:
        return cast(DeviceKind, import_module(_HERE[name]).KIND)
    if name not in added(GROUP):
        raise SettingError("device", repr(name), f"one of: {', '.join(names())}")
    return load(GROUP, name, DeviceKind)


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
    name = config.choice.name
    try:
        return device_kind(name).open(config)
    except CohapticError:
        raise
    except Exception as error:  # the user is told in a sentence, whatever a driver of others raises
        if name in _HERE or adder(GROUP, name) == OURS:
            raise
        raise DeviceError(name, f"its driver failed ({error})") from error


def search() -> tuple[list[Found], list[DeviceError]]:
    """Devices of this machine, and what was missing to look for others."""
    found: list[Found] = []
    missing: list[DeviceError] = []
    for name in names():
        try:
            found += device_kind(name).find()
        except DeviceError as error:
            missing.append(error)
        except ExtensionError as error:
            missing.append(DeviceError(name, error.problem, f"install {error.package} anew"))
        except Exception as error:  # code of others: the devices of everybody else are looked for
            if name in _HERE or adder(GROUP, name) == OURS:
                raise
            missing.append(DeviceError(name, f"its driver failed ({error})"))
    return found, missing
