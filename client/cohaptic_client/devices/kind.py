"""Descriptions of a device: the choice by a user, the configuration for the loop, the driver.

The user types a choice as text: `NAME`, `NAME:VALUE` or `NAME:KEY=VALUE,KEY=VALUE`. The
configuration adds the body's position in the world, for the loop that opens the device. The driver
describes its options and abilities to the catalogue, and how its devices are found and opened.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

from cohaptic.clock import Clock
from cohaptic.errors import SettingError
from cohaptic.simulated.hand import Hand, Intention, Rhythm
from cohaptic.vec import Vec3
from cohaptic_client.devices.device import Device, DeviceInfo

LONGEST = 1000  # characters; a path and a few numbers are far shorter


@dataclass(frozen=True, slots=True)
class DeviceChoice:
    """Name of a device, with the options that the user typed.

    Args:
        name: Name in the catalogue.
        options: Key and value of each option, as text, in the typed order; no key occurs twice.
    """

    name: str
    options: tuple[tuple[str, str], ...] = ()

    def text(self, key: str, default: str = "") -> str:
        """Return the value of an option; `default` if the user did not type it."""
        return dict(self.options).get(key, default)

    def one_of(self, key: str, values: Iterable[str], default: str) -> str:
        """Return the value of an option; raise SettingError if it is not one of `values`."""
        value = self.text(key, default)
        if value not in (known := list(values)):
            raise SettingError(f"{self.name}:{key}", repr(value), f"one of: {', '.join(known)}")
        return value

    def number(self, key: str, default: float, low: float, high: float, unit: str = "") -> float:
        """Return the value of a numeric option; raise SettingError outside `low` to `high`."""
        value = self.text(key, str(default))
        limit = f"a number from {low:g} to {high:g} {unit}".rstrip()
        try:
            number = float(value)
        except ValueError:
            raise SettingError(f"{self.name}:{key}", repr(value), limit) from None
        if not low <= number <= high:
            raise SettingError(f"{self.name}:{key}", value, limit)
        return number

    def __str__(self) -> str:
        listed = ",".join(f"{key}={value}" for key, value in self.options)
        return f"{self.name}:{listed}" if listed else self.name

    @classmethod
    def from_dict(cls, raw: dict[str, Any]) -> DeviceChoice:
        """Rebuild a choice from the plain values that `dataclasses.asdict` and JSON made of it."""
        return cls(raw["name"], tuple((key, value) for key, value in raw["options"]))


SIMULATED = DeviceChoice("simulated")  # the default


def split_choice(text: str) -> tuple[str, list[tuple[str, str]]]:
    """Split the text of a choice into the name and the options, as pairs of key and value.

    A first value without a key gets an empty key.

    Raises:
        SettingError: The text is too long, an option has no value, or a later option has no key.
    """
    if len(text) > LONGEST:
        raise SettingError("device", f"{len(text)} characters long", f"at most {LONGEST}")
    name, _, listed = text.partition(":")
    options: list[tuple[str, str]] = []
    for item in listed.split(",") if listed else []:
        key, equals, value = item.partition("=")
        if not equals:
            key, value = "", item
        if (not key and options) or not value:
            raise SettingError("option of a device", repr(item), "KEY=VALUE")
        options.append((key, value))
    return name, options


@dataclass(frozen=True, slots=True)
class DeviceConfig:
    """What a driver needs to open a device: choice, position of the body, simulated hand.

    Args:
        choice: Choice of the device, by name and options.
        center: Centre of the body, around which the device's workspace is placed [m].
        radius: Radius of the sphere round `center` that holds the body [m].
        hand: Mechanics of a simulated hand.
        intention: Intention of a simulated hand; None for a real one.
    """

    choice: DeviceChoice
    center: Vec3
    radius: float
    hand: Hand
    intention: Intention | None

    @classmethod
    def from_dict(cls, raw: dict[str, Any]) -> DeviceConfig:
        """Rebuild a configuration from the plain values that `dataclasses.asdict` made of it."""
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


@dataclass(frozen=True, slots=True)
class Found:
    """A device that a search has found on this machine.

    Args:
        choice: Text after `--device` that chooses it.
        where: Description of where it was found, such as its product and path.
        problem: Reason why it cannot be used; empty for none.
        advice: Advice to the user on that problem; empty for none.
    """

    choice: str
    where: str
    problem: str = ""
    advice: str = ""


def nothing_found() -> list[Found]:
    """Return an empty list, for drivers that cannot search for devices."""
    return []


def upward(choice: DeviceChoice) -> Vec3:
    """Return the upward unit vector, along which a device with three force axes knocks."""
    return (0.0, 0.0, 1.0)


@dataclass(frozen=True, slots=True)
class DeviceKind:
    """A driver, as the catalogue knows it.

    Args:
        name: Name after `--device`.
        summary: Description in a few words.
        options: Key and meaning of each option; a value without a key sets the first option.
        info: Function that returns the abilities of a device with these options, without opening
            it; it raises SettingError for a value that is outside its limits.
        open: Function that opens a device; it raises DeviceError if the device cannot be opened.
        find: Function that searches for devices and tries to open each, without a force; it raises
            DeviceError if something that the search needs is missing.
        knock: Function that returns the direction in which a device with these options pushes; a
            unit vector.
        calibrate: Function that measures the user's device with the user's help, and returns the
            lines of its file; None for a driver without calibration.
    """

    name: str
    summary: str
    options: tuple[tuple[str, str], ...]
    info: Callable[[DeviceChoice], DeviceInfo]
    open: Callable[[DeviceConfig], Device]
    find: Callable[[], list[Found]] = nothing_found
    knock: Callable[[DeviceChoice], Vec3] = upward
    calibrate: Callable[[DeviceChoice, Clock, Callable[[str], None]], list[str]] | None = None

    def choice(self, options: list[tuple[str, str]]) -> DeviceChoice:
        """Make a choice of this driver's device from the options that `split_choice` found.

        Raises:
            SettingError: A key is unknown or given twice, or a value is outside its limits.
        """
        keys = [key for key, _ in self.options]
        if not keys and options:
            raise SettingError(f"options of {self.name}", options[0][1], "left out: it has none")
        named = [(key or keys[0], value) for key, value in options]
        seen: set[str] = set()
        for key, _ in named:
            if key not in keys:
                limit = f"one of: {', '.join(keys)}"
                raise SettingError(f"option of {self.name}", repr(key), limit)
            if key in seen:
                raise SettingError(f"option of {self.name}", repr(key), "given once")
            seen.add(key)
        choice = DeviceChoice(self.name, tuple(named))
        self.info(choice)
        return choice
