"""A user's choice of a device as text: `NAME`, `NAME:VALUE` or `NAME:KEY=VALUE,KEY=VALUE`."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from cohaptic.errors import SettingError

LONGEST = 1000  # characters; a path and a few numbers are far shorter


@dataclass(frozen=True, slots=True)
class DeviceChoice:
    """A device by name, with the options that were given.

    Args:
        name: Name in the catalogue.
        options: Key and value of each option, as text, in the order given; no key occurs twice.
    """

    name: str
    options: tuple[tuple[str, str], ...] = ()

    def text(self, key: str, default: str = "") -> str:
        """Value of an option; `default` if the option was not given."""
        return dict(self.options).get(key, default)

    def one_of(self, key: str, values: Iterable[str], default: str) -> str:
        """Value of an option that has to be one of `values`; raises SettingError."""
        value = self.text(key, default)
        if value not in (known := list(values)):
            raise SettingError(f"{self.name}:{key}", repr(value), f"one of: {', '.join(known)}")
        return value

    def number(self, key: str, default: float, low: float, high: float, unit: str = "") -> float:
        """Value of an option that is a number from `low` to `high`; raises SettingError."""
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
        """The choice that `dataclasses.asdict` and JSON have turned into these plain values."""
        return cls(raw["name"], tuple((key, value) for key, value in raw["options"]))


SIMULATED = DeviceChoice("simulated")  # the default


def split_choice(text: str) -> tuple[str, list[tuple[str, str]]]:
    """Split a text into name and options; a first value without a key gets an empty key.

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
