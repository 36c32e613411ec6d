"""One user's side: a 1 kHz loop on its own, a link to the server, a device.

Its top level stays light, because the process that runs the loop imports it: a public name is
imported from its module when it is first used.
"""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from cohaptic_client.client import Client as Client
    from cohaptic_client.devices.device import Device as Device
    from cohaptic_client.devices.device import DeviceInfo as DeviceInfo
    from cohaptic_client.devices.device import DeviceSample as DeviceSample
    from cohaptic_client.devices.simulated import SimulatedDevice as SimulatedDevice
    from cohaptic_client.recorder import Recorder as Recorder
    from cohaptic_client.settings import ClientSettings as ClientSettings

__all__ = [
    "Client",
    "ClientSettings",
    "Device",
    "DeviceInfo",
    "DeviceSample",
    "Recorder",
    "SimulatedDevice",
]

# The module that defines each public name.
_HOMES = {
    "Client": "cohaptic_client.client",
    "Device": "cohaptic_client.devices.device",
    "DeviceInfo": "cohaptic_client.devices.device",
    "DeviceSample": "cohaptic_client.devices.device",
    "SimulatedDevice": "cohaptic_client.devices.simulated",
    "Recorder": "cohaptic_client.recorder",
    "ClientSettings": "cohaptic_client.settings",
}

if not TYPE_CHECKING:  # otherwise a type checker would accept any name

    def __getattr__(name: str) -> object:
        """Import a public name when it is first used (PEP 562)."""
        if name not in _HOMES:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        value = globals()[name] = getattr(import_module(_HOMES[name]), name)
        return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
