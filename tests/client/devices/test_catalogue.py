from __future__ import annotations

from dataclasses import replace

import pytest

from cohaptic.errors import DeviceError, SettingError
from cohaptic.vec import ZERO, Vec3
from cohaptic_client.devices.catalogue import (
    device_info,
    device_kind,
    names,
    open_device,
    read_device,
)
from cohaptic_client.devices.kind import DeviceChoice
from cohaptic_client.devices.simulated import SimulatedDevice
from cohaptic_client.devices.spacemouse import SpaceMouse
from tests.client.plane import CONFIG


@pytest.mark.parametrize("name", names())
def test_what_a_device_can_do_is_known_without_having_it(name: str) -> None:
    info = device_info(DeviceChoice(name))
    assert device_kind(name).name == name
    assert info.max_stiffness > 0.0
    assert info.max_force >= 0.0
    assert info.stall > 0.0
    assert info.rate > 0.0
    assert 1 <= info.sensed_axes <= 3
    assert (info.force_axes > 0) == (info.max_force > 0.0)


@pytest.mark.parametrize("name", ["", "Simulated", "phantom"])
def test_an_unknown_name_is_answered_with_those_that_exist(name: str) -> None:
    with pytest.raises(SettingError) as caught:
        read_device(name)
    assert str(caught.value) == f"device is {name!r}; it must be one of: {', '.join(names())}"


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

    monkeypatch.setattr("cohaptic_client.devices.spacemouse.open_spacemouse", no_hardware)
    choice = DeviceChoice("spacemouse")
    with pytest.raises(DeviceError):
        open_device(replace(CONFIG.device, choice=choice, center=(1.0, 2.0, 3.0), radius=0.5))
    assert asked == {"center": ZERO, "reach": 1.0}

    class Reports:
        def read(self, max_length: int, /) -> list[int]:
            return [1, 94, 1, 0, 0, 0, 0]  # in full to the right

        def close(self) -> None:
            pass

    def mouse(center: Vec3, reach: float) -> SpaceMouse:
        return SpaceMouse(Reports(), center, reach=reach)

    monkeypatch.setattr("cohaptic_client.devices.spacemouse.open_spacemouse", mouse)
    choice = read_device("spacemouse:scale=2,turn=90")
    device = open_device(replace(CONFIG.device, choice=choice, center=(1.0, 2.0, 3.0), radius=0.5))
    tip = device.read(0.0)
    # The middle of the face that is nearest to a user who sits on the right.
    assert tip.position == pytest.approx((2.0, 2.0, 3.0))
    assert tip.velocity == pytest.approx((0.0, 0.3, 0.0))
