from __future__ import annotations

import pytest

from cohaptic.control.law import Law
from cohaptic.protocol.messages import FixedGains
from cohaptic_client.devices.catalogue import device_info
from cohaptic_client.devices.kind import DeviceChoice
from cohaptic_client.network.conversation import greeting
from cohaptic_client.settings import ClientSettings


@pytest.mark.parametrize("name", ["simulated", "spacemouse"])
@pytest.mark.parametrize("friction", [0.0, 0.5])
def test_the_greeting_names_the_user_the_law_and_the_limits_of_the_device(
    name: str, friction: float
) -> None:
    """Whole conversations with a server are in `tests/client/test_client.py`."""
    settings = ClientSettings(
        url="ws://127.0.0.1:1",
        name="left",
        law=Law.PI,
        device=DeviceChoice(name),
        friction=friction,
        geometry="sphere",
        fixed_gains=FixedGains(k_h=100.0, integral_gain=10.0),
    )
    hello = greeting(settings)
    assert (hello.name, hello.law, hello.geometry) == ("left", Law.PI, "sphere")
    assert hello.fixed_gains == settings.fixed_gains
    assert hello.friction is (friction > 0.0)
    assert hello.max_stiffness == device_info(DeviceChoice(name)).max_stiffness
    assert hello.max_force == settings.force_limit
    assert hello.damping_budget == settings.damping_limit
