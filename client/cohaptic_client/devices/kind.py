"""What a driver tells the catalogue of itself: its options, its abilities, how it is opened."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from cohaptic.clock import Clock
from cohaptic.errors import SettingError
from cohaptic.vec import Vec3
from cohaptic_client.devices.choice import DeviceChoice
from cohaptic_client.devices.device import Device, DeviceInfo
from cohaptic_client.devices.device_config import DeviceConfig


@dataclass(frozen=True, slots=True)
class Found:
    """A device of this machine.

    Args:
        choice: After `--device`, to choose it.
        where: It was found.
        problem: What keeps it from use; empty for nothing.
        advice: What the user can do about it.
    """

    choice: str
    where: str
    problem: str = ""
    advice: str = ""


def nothing_found() -> list[Found]:
    """For drivers that have nothing to look for."""
    return []


def upward(choice: DeviceChoice) -> Vec3:
    """Direction of a knock for drivers whose devices push every way."""
    return (0.0, 0.0, 1.0)


@dataclass(frozen=True, slots=True)
class DeviceKind:
    """A driver, as the catalogue knows it.

    Args:
        name: After `--device`.
        summary: What it is, in a few words.
        options: Key and meaning of each; the first is the one that a bare value sets.
        info: Abilities of a device with these options, without having it; raises SettingError for
            a value that is outside its limits.
        open: Opens a device; raises DeviceError when it cannot be had.
        find: Looks for devices and tries each, without a force; raises DeviceError when what it
            takes to look is missing.
        knock: Direction in which a device with these options is felt to push; a unit vector.
        calibrate: Finds out what the file of the unit at hand has to say, by what it asks the user
            to do, and returns its lines; None where there is nothing of the kind.
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
        """The choice of this kind with options as `split_choice` found them.

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
