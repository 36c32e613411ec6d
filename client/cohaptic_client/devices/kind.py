"""Description of a driver for the catalogue: its options, its abilities, how it is opened."""

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
        choice: Text after `--device` that chooses it.
        where: Place where it was found, such as its product and path.
        problem: Reason why it cannot be used; empty for none.
        advice: Advice to the user on that problem; empty for none.
    """

    choice: str
    where: str
    problem: str = ""
    advice: str = ""


def nothing_found() -> list[Found]:
    """Return no devices; the `find` of drivers that have nothing to look for."""
    return []


def upward(choice: DeviceChoice) -> Vec3:
    """Upward unit vector, the direction of a knock for devices that push in every direction."""
    return (0.0, 0.0, 1.0)


@dataclass(frozen=True, slots=True)
class DeviceKind:
    """A driver, as the catalogue knows it.

    Args:
        name: Name after `--device`.
        summary: Description in a few words.
        options: Key and meaning of each option; a bare value sets the first option.
        info: Returns the abilities of a device with these options, without opening it; raises
            SettingError for a value that is outside its limits.
        open: Opens a device; raises DeviceError when it cannot be opened.
        find: Looks for devices and tries each, without a force; raises DeviceError when something
            that the search needs is missing.
        knock: Returns the direction in which a device with these options pushes; a unit vector.
        calibrate: Measures the unit at hand with the user's help, and returns the lines of its
            file; None for a driver without calibration.
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
        """Make a choice of this driver's device, with the options that `split_choice` found.

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
