"""The device that a script passes as an object: its choice holds its abilities.

The object itself comes to the process of the haptic loop by `cohaptic_client.loop.passed`.
"""

from __future__ import annotations

import json
from typing import Final

from cohaptic.errors import DeviceError, SettingError
from cohaptic_client.devices.device import Device, DeviceInfo
from cohaptic_client.devices.kind import DeviceChoice, DeviceConfig, DeviceKind


def passed_choice(info: str) -> DeviceChoice:
    """Return the choice of a passed device with these abilities, as JSON."""
    return DeviceChoice("passed", (("info", info),))


def _info(choice: DeviceChoice) -> DeviceInfo:
    if not (text := choice.text("info")):
        raise SettingError("device", "passed", "given by a script, as an object")
    return DeviceInfo(**json.loads(text))


def _open(config: DeviceConfig) -> Device:
    raise DeviceError(_info(config.choice).name, "it came with no object", "pass it by a script")


KIND: Final = DeviceKind(
    "passed", "an object of a script", (("info", "its abilities as JSON"),), _info, _open
)
