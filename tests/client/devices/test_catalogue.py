from __future__ import annotations

from dataclasses import replace

import pytest

from cohaptic.errors import DeviceError, SettingError
from cohaptic_client.devices.catalogue import device_info, open_device
from cohaptic_client.devices.simulated import SimulatedDevice
from cohaptic_client.devices.spacemouse import SpaceMouse
from tests.client.plane import CONFIG

NAMES = ("simulated", "spacemouse")


@pytest.mark.parametrize("name", NAMES)
def test_what_a_device_can_do_is_known_without_having_it(name: str) -> None:
    info = device_info(name)
    assert info.name == name
    assert info.max_stiffness > 0.0
    assert info.max_force >= 0.0
    assert info.stall > 0.0


@pytest.mark.parametrize("name", ["", "Simulated", "phantom"])
def test_an_unknown_name_is_answered_with_those_that_exist(name: str) -> None:
    with pytest.raises(SettingError) as caught:
        device_info(name)
    assert str(caught.value) == f"device is {name!r}; it must be one of: {', '.join(NAMES)}"


def test_the_simulated_device_follows_the_configured_hand() -> None:
    device = open_device(CONFIG.device)
    assert isinstance(device, SimulatedDevice)
    assert CONFIG.device.intention is not None
    assert device.read(0.0).position == CONFIG.device.intention.at(0.0)
    device.close()


def test_the_spacemouse_moves_in_a_cube_of_twice_the_bodys_size(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    asked: dict[str, object] = {}

    def no_hardware(**asked_for: object) -> SpaceMouse:
        asked.update(asked_for)
        raise DeviceError("spacemouse", "no SpaceMouse was found")

    monkeypatch.setattr("cohaptic_client.devices.catalogue.open_spacemouse", no_hardware)
    with pytest.raises(DeviceError):
        open_device(replace(CONFIG.device, name="spacemouse", center=(1.0, 2.0, 3.0), radius=0.5))
    assert asked == {"center": (1.0, 2.0, 3.0), "reach": 1.0}
