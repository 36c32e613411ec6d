from __future__ import annotations

import pytest

from cohaptic.errors import SettingError
from cohaptic_client.devices.catalogue import (
    device_info,
    device_kind,
    names,
    read_device,
)
from cohaptic_client.devices.kind import DeviceChoice


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
