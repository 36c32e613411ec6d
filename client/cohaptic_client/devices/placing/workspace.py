"""The map between the frame of a device and the world, in both directions.

The axes of a device's frame are those of the world as the user sees them: right, away from the user
and up. With scale s, a motion of the device by d is a motion by s d in the world. Forces keep their
size, because the limits of the safety layer are newtons on the hand. Power is therefore scaled by
the constant 1 / s, and a passive port behind a constant factor stays passive. The hand feels a
stiffness k of the world as s k, so a device that renders the stiffness k_d stably can render
k_d / s in the world; the same holds for damping.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from cohaptic.vec import Vec3
from cohaptic_client.devices.device import DeviceInfo


@dataclass(frozen=True, slots=True)
class Workspace:
    """Position, scale and rotation of a device's frame in the world.

    Args:
        origin: Point of the device's frame that lies on `center` [m].
        center: Point of the world on which `origin` lies [m].
        scale: Metres of the world for a metre of the device.
        turn: Rotation of the device's frame about the vertical, counterclockwise from above [rad].
    """

    origin: Vec3
    center: Vec3
    scale: float = 1.0
    turn: float = 0.0

    def position(self, device: Vec3) -> Vec3:
        """Map the point `device` of the device's frame to the world [m]."""
        o, c = self.origin, self.center
        x, y, z = self.velocity((device[0] - o[0], device[1] - o[1], device[2] - o[2]))
        return (c[0] + x, c[1] + y, c[2] + z)

    def velocity(self, device: Vec3) -> Vec3:
        """Map the velocity `device` in the device's frame to the world [m/s]."""
        s = self.scale
        x, y, z = _turned(device, self.turn)
        return (s * x, s * y, s * z)

    def force(self, world: Vec3) -> Vec3:
        """Rotate a force from the world into the device's frame; its size stays the same [N]."""
        return _turned(world, -self.turn)

    def holding(self, device: Vec3, world: Vec3) -> Workspace:
        """Return this map, shifted so that the point `device` of the frame lies on `world`."""
        return replace(self, origin=device, center=world)


def seen_from_world(info: DeviceInfo, scale: float) -> DeviceInfo:
    """Convert the abilities of a device to the world, for a workspace of this scale."""
    return replace(
        info,
        max_stiffness=info.max_stiffness / scale,
        damping=info.damping / scale,
        max_damping=info.max_damping / scale,
        inertia=info.inertia / scale,
        resolution=info.resolution * scale,
    )


def _turned(v: Vec3, angle: float) -> Vec3:
    if angle == 0.0:
        return v
    c, s = math.cos(angle), math.sin(angle)
    return (c * v[0] - s * v[1], s * v[0] + c * v[1], v[2])
