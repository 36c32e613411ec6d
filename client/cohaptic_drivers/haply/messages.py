"""Messages of the Haply service, SDK 3.5: bytes in, values out. Pure.

Every key counts as optional, as the service leaves out what it likes; a state without a position
and a velocity is no state. Frame of the service: right, away from the user, up, in metres and
newtons, which is that of cohaptic.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any, cast

from cohaptic.vec import Vec3, is_finite

# m and m/s; an arm of 0.3 m cannot be there, so the numbers are no position and no velocity of it.
FARTHEST = 1.0
FASTEST = 100.0

HELLO = '{"session":{"configure":{"profile":{"name":"cohaptic"}},"force_render_full_state":{}}}'


class GarbledReport(Exception):
    """A message that the service cannot have meant."""


@dataclass(frozen=True, slots=True)
class Arm:
    """What the service tells of a device.

    Args:
        id: Identifier of the device.
        position: Position of its tip, right, away from the user, up [m].
        velocity: [m/s].
        status: Its flags, such as `calibrated` and `power_supply`.
        frame: What is special about the axes in which the service speaks; empty if nothing is.
    """

    id: str
    position: Vec3
    velocity: Vec3
    status: dict[str, bool]
    frame: str


@dataclass(frozen=True, slots=True)
class Report:
    """One message of the service.

    Args:
        arms: By their id.
        grips: By the id of each grip whether a button of it is held.
    """

    arms: dict[str, Arm]
    grips: dict[str, bool]


def force_message(device: str, force: Vec3) -> str:
    """The command that gives `force` [N] to the hand."""
    x, y, z = force
    # By hand, as json takes ten times as long; repr of a finite float is JSON.
    return (
        f'{{"inverse3":[{{"device_id":"{device}","commands":{{"set_cursor_force":'
        f'{{"values":{{"x":{x!r},"y":{y!r},"z":{z!r}}}}}}}}}]}}'
    )


def decode(text: str, only: str = "") -> Report:
    """Contents of a message of the service.

    Args:
        text: The message.
        only: Id of the device that matters, where one is in use already; what is wrong with the
            state of another is no concern of it.

    Raises:
        GarbledReport: The message, or a state in it that matters, is not whole.
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
    """Whether a first message is one of the Haply service, not of another program."""
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
    # Goes into messages as it is.
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
    """Whether a button of a grip is held; each make has names of its own for them."""
    state = grip.get("state", {})
    return bool(state.get("button") or any(state.get("buttons", {}).values()))
