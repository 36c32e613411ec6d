"""The simulated device, as the catalogue knows it."""

from __future__ import annotations

from cohaptic_client.devices.choice import DeviceChoice
from cohaptic_client.devices.device import DeviceInfo
from cohaptic_client.devices.device_config import DeviceConfig
from cohaptic_client.devices.kind import DeviceKind
from cohaptic_client.devices.presets import PRESETS
from cohaptic_client.devices.simulated import INFO, SimulatedDevice

_RIG = "rig"  # no preset: the rig of `INFO`


def simulated_info(choice: DeviceChoice) -> DeviceInfo:
    """Abilities of the simulated device; raises SettingError for a preset that there is not."""
    preset = choice.one_of("preset", (_RIG, *PRESETS), _RIG)
    return INFO if preset == _RIG else PRESETS[preset]


def open_simulated(config: DeviceConfig) -> SimulatedDevice:
    """A hand that follows the intention of the configuration, on the device that was chosen."""
    assert config.intention is not None
    info = simulated_info(config.choice)
    return SimulatedDevice(config.hand, config.intention, info, waits=True)


KIND = DeviceKind(
    "simulated",
    "a hand that follows a script, on a device in virtual air",
    (("preset", f"limits and mechanics of a device: {', '.join(PRESETS)}; or {_RIG}"),),
    simulated_info,
    open_simulated,
)
