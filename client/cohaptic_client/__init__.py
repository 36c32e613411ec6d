"""One user's side: a 1 kHz loop on its own, a link to the server, a device.

Its top level stays light, because the process that runs the loop imports it: a public name is
imported from its module when it is first used.
"""

from typing import TYPE_CHECKING

from cohaptic.lazy import lazy_names

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
    __getattr__, __dir__ = lazy_names(globals(), _HOMES)
