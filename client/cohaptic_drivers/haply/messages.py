"""Pure functions that read and write the messages of the Haply service, SDK 3.5.

Every key is optional, because the service omits keys at will; only a state without a position or a
velocity is rejected. The frame of the service is that of cohaptic: right, away from the user, up,
in metres and newtons.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any, cast

from cohaptic.vec import Vec3, is_finite

# m and m/s; an arm of 0.3 m cannot reach them, so larger numbers are garbage.
FARTHEST = 1.0
FASTEST = 100.0

HELLO = '{"session":{"configure":{"profile":{"name":"cohaptic"}},"force_render_full_state":{}}}'


class GarbledReport(Exception):
    """A message is not a valid report of the service."""


@dataclass(frozen=True, slots=True)
class Arm:
    """State of one device, as the service reports it.

    Args:
        position: Position of its tip, right, away from the user, up [m].
        velocity: Velocity of its tip [m/s].
        status: Flags of the device, such as `calibrated` and `power_supply`.
        frame: How the report's axes differ from the usual ones, in words; empty if they do not.
    """

    id: str
    position: Vec3
    velocity: Vec3
    status: dict[str, bool]
    frame: str


@dataclass(frozen=True, slots=True)
class Report:
    """One message of the service: the states of all devices and grips.

    Args:
        arms: States of the devices, by id.
        grips: Whether a button of each grip is pressed, by the id of the grip.
    """

    arms: dict[str, Arm]
    grips: dict[str, bool]


def force_message(device: str, force: Vec3) -> str:
    """Return the text of the command that gives `force` [N] to the hand."""
    x, y, z = force
    # Formatted here, because `json` takes ten times as long; repr of a finite float is JSON.
    return (
        f'{{"inverse3":[{{"device_id":"{device}","commands":{{"set_cursor_force":'
        f'{{"values":{{"x":{x!r},"y":{y!r},"z":{z!r}}}}}}}}}]}}'
    )


def decode(text: str, only: str = "") -> Report:
    """Decode a message of the service.

    Args:
        text: The message.
        only: Id of the device in use, so that the states of other devices are skipped and their
            errors do not matter; empty to read all states.

    Raises:
        GarbledReport: The message, or a state that is read, is incomplete or invalid.
    """
    try:
        read = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise GarbledReport("it is no JSON") from error
    message: dict[str, Any] = cast(dict[str, Any], read) if isinstance(read, dict) else {}
    listed: Any = message.get("inverse3", [] if message else None)
    if not isinstance(listed, list):
        raise GarbledReport("it lists no devices")
    try:
        raws = cast(list[dict[str, Any]], listed)
        arms = [_arm(raw) for raw in raws if not only or raw.get("device_id") == only]
        grips = {
            str(grip.get("device_id", f"{key} {number}")): _pressed(grip)
            for key, listed_grips in message.items()
            if "grip" in key
            for number, grip in enumerate(listed_grips, start=1)
        }
    except (KeyError, TypeError, ValueError, AttributeError, OverflowError) as error:
        raise GarbledReport(f"a state in it is not whole ({error!r})") from error
    return Report({arm.id: arm for arm in arms}, grips)


def knows_service(text: str) -> bool:
    """Return whether a first message comes from the Haply service, not from another program."""
    try:
        message = json.loads(text)
    except (ValueError, RecursionError):
        return False
    return isinstance(message, dict) and "inverse3" in message


def _arm(raw: dict[str, Any]) -> Arm:
    state = raw["state"]
    position, velocity = _vector(state["cursor_position"]), _vector(state["cursor_velocity"])
    if max(map(abs, position)) > FARTHEST or max(map(abs, velocity)) > FASTEST:
        raise ValueError(f"tip at {position} m with {velocity} m/s")
    device = raw["device_id"]
    # The id goes into messages unchanged, so it must not need JSON escapes.
    if not isinstance(device, str) or not device.isalnum() or len(device) > 32:
        raise ValueError("device_id")
    status = {str(k): bool(v) for k, v in raw.get("status", {}).items()}
    return Arm(device, position, velocity, status, _frame(raw))


def _vector(raw: dict[str, float]) -> Vec3:
    v = (float(raw["x"]), float(raw["y"]), float(raw["z"]))
    if not is_finite(v):
        raise ValueError(f"{v}")
    return v


_IDENTITY = {
    "position": {"x": 0.0, "y": 0.0, "z": 0.0},
    "rotation": {"w": 1.0, "x": 0.0, "y": 0.0, "z": 0.0},
    "scale": {"x": 1.0, "y": 1.0, "z": 1.0},
}


def _frame(raw: dict[str, Any]) -> str:
    basis = raw.get("config", {}).get("basis", {}).get("permutation", "XYZ")
    if basis != "XYZ":
        return f"its axes are permuted ({str(basis)[:20]})"
    transform = raw["state"].get("transform", {})
    for part, same in _IDENTITY.items():
        for axis, value in transform.get(part, {}).items():
            if abs(float(value) - same.get(axis, 0.0)) > 1e-6:
                return f"its {part} is transformed"
    return ""


def _pressed(grip: dict[str, Any]) -> bool:
    """Return whether a button of a grip is pressed; makes of grips name buttons differently."""
    state = grip.get("state", {})
    return bool(state.get("button") or any(state.get("buttons", {}).values()))
