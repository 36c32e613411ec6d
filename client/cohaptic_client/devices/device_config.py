"""Configuration of the device that a loop opens, and of its place in the world."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from cohaptic.simulated.hand import Hand, Intention, Rhythm
from cohaptic.vec import Vec3
from cohaptic_client.devices.choice import DeviceChoice


@dataclass(frozen=True, slots=True)
class DeviceConfig:
    """A device, the place of the body to touch, and the hand of a simulated device.

    Args:
        choice: Choice of the device, by name and options.
        center: Centre of the body, by which a device's workspace is placed [m].
        radius: Radius of the sphere round `center` that holds the body [m].
        hand: Mechanics of a simulated device.
        intention: Intention of a simulated device; None for a real one.
    """

    choice: DeviceChoice
    center: Vec3
    radius: float
    hand: Hand
    intention: Intention | None

    @classmethod
    def from_dict(cls, raw: dict[str, Any]) -> DeviceConfig:
        """The configuration that `dataclasses.asdict` has turned into these plain values."""
        intention = raw["intention"]
        if intention is not None:
            rhythm = intention["rhythm"]
            intention = Intention(
                **intention
                | {
                    "surface": tuple(intention["surface"]),
                    "direction": tuple(intention["direction"]),
                    "rhythm": None if rhythm is None else Rhythm(**rhythm),
                    "drag": tuple(intention["drag"]),
                }
            )
        hand = Hand(**raw["hand"])
        choice = DeviceChoice.from_dict(raw["choice"])
        return cls(choice, tuple(raw["center"]), raw["radius"], hand, intention)
