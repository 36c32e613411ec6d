"""Devices by name."""

from __future__ import annotations

from cohaptic.errors import SettingError
from cohaptic_client.devices import simulated
from cohaptic_client.devices.device import Device, DeviceInfo
from cohaptic_client.devices.device_config import DeviceConfig
from cohaptic_client.devices.simulated import SimulatedDevice
from cohaptic_client.devices.spacemouse import SpaceMouse, open_spacemouse

_INFO = {"simulated": simulated.INFO, "spacemouse": SpaceMouse.info}


def device_info(name: str) -> DeviceInfo:
    """Abilities of the device called `name`; raises SettingError with the names that exist."""
    if name not in _INFO:
        raise SettingError("device", repr(name), f"one of: {', '.join(_INFO)}")
    return _INFO[name]


def open_device(config: DeviceConfig) -> Device:
    """Open the device of a configuration; raises DeviceError when it cannot be had."""
    if config.name == "simulated":
        assert config.intention is not None
        return SimulatedDevice(config.hand, config.intention)
    return open_spacemouse(center=config.center, reach=2.0 * config.radius)
