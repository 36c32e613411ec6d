"""Options of all devices with a workspace, and the workspace that follows from them."""

from __future__ import annotations

import math

from cohaptic.vec import ZERO, Vec3
from cohaptic_client.devices.device import DeviceInfo
from cohaptic_client.devices.kind import DeviceChoice, DeviceConfig
from cohaptic_client.devices.placing.placed import Placed, RawDevice
from cohaptic_client.devices.placing.workspace import Workspace, seen_from_world

PLACING_OPTIONS = (
    ("scale", "metres in the world for a metre of the device, 0.2 to 5"),
    ("turn", "of the device about the vertical, degrees"),
    ("place", "where its middle is put: front (of the body), top or center"),
    ("recentre", "yes: where the tip is at the start counts as its middle"),
    ("clutch", "number of the button that holds the tip while the hand moves on; 0 for none"),
)

# Multiple of the body's radius: just outside the sphere that holds the body, so that a hand in the
# middle of its workspace touches nothing at the start.
_OUTSIDE = 1.1
_PLACES: dict[str, Vec3] = {
    "front": (0.0, -_OUTSIDE, 0.0),
    "top": (0.0, 0.0, _OUTSIDE),
    "center": ZERO,
}


SWITCH = 1  # bit of `DeviceSample.buttons` for the switch of `DeviceInfo.switch`


def scale_of(choice: DeviceChoice) -> float:
    """Return the metres of the world for a metre of the device; SettingError outside 0.2 to 5."""
    # Beyond a factor of 5 the stiffness or the speed in the world is too small to be useful.
    return choice.number("scale", 1.0, 0.2, 5.0)


def turn_of(choice: DeviceChoice) -> float:
    """Return the frame's rotation about the vertical [rad]; SettingError beyond 360 degrees."""
    return math.radians(choice.number("turn", 0.0, -360.0, 360.0, "degrees"))


def placed_info(choice: DeviceChoice, info: DeviceInfo) -> DeviceInfo:
    """Return the abilities that a device has in the world; raise SettingError for a wrong option.

    Args:
        choice: Choice with the options of the workspace.
        info: Abilities of the device in its own frame.
    """
    choice.one_of("place", _PLACES, "front")
    choice.one_of("recentre", ("yes", "no"), "no")
    turn_of(choice)
    clutch_of(choice)
    return seen_from_world(info, scale_of(choice))


def clutch_is_switch(choice: DeviceChoice, info: DeviceInfo) -> bool:
    """Return whether clutch and switch are the same button, which makes one of them useless."""
    return info.switch and clutch_of(choice) == SWITCH


def place(raw: RawDevice, config: DeviceConfig, *, middle: Vec3) -> Placed:
    """Place a device in the world as the options of its configuration say.

    Args:
        raw: Device in its own frame.
        config: Configuration with the choice and the body's position.
        middle: Middle of the device's workspace, in its own frame [m].
    """
    choice = config.choice
    dx, dy, dz = _PLACES[choice.one_of("place", _PLACES, "front")]
    (x, y, z), r = config.center, config.radius
    return Placed(
        raw,
        Workspace(
            origin=middle,
            center=(x + r * dx, y + r * dy, z + r * dz),
            scale=scale_of(choice),
            turn=turn_of(choice),
        ),
        recentre=choice.one_of("recentre", ("yes", "no"), "no") == "yes",
        clutch=clutch_of(choice),
    )


def clutch_of(choice: DeviceChoice) -> int:
    """Return the bit of the clutch's button in `DeviceSample.buttons`; 0 without a clutch."""
    number = int(choice.number("clutch", 0, 0, 16))
    return 1 << number - 1 if number else 0
