"""An option of an object: how it is named, limited, read and written, wherever it is given.

An option is given in one form everywhere, on the command line, in a file of rooms and in a message
of the process that reads an upload: a number in the unit of its help, a text, or a list of texts.

The help of a command needs this module, so it imports no numpy and nothing of an object.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from operator import attrgetter
from pathlib import Path
from typing import Any

from cohaptic.errors import SettingError

Named = tuple[tuple[str, float], ...]  # values by the names of parts


@dataclass(frozen=True, slots=True)
class Limits:
    """Range of a number.

    Args:
        least: Smallest value.
        limit: Largest value.
        words: The range in words, for an error.
        zero: Whether 0 is allowed, too.
        reported: Format of a value in an error, in the unit of the command line.
    """

    least: float
    limit: float
    words: str
    zero: bool = False
    reported: str = "{}"


@dataclass(frozen=True, slots=True)
class Option:
    """An option of an object.

    Args:
        name: Name as a key of a table; on the command line with dashes.
        help: Sentence of the command's help.
        at: Attribute of an `ObjectFile` that holds the value, as `material.order`; the name if it
            is empty.
        default: Value of the attribute if the option is not given; None for that of the field.
        kind: Type of a given value; `tuple` for texts. None for the type of the default.
        optional: Whether a command has to know if the option is given; if not, its value is None.
        unit: Value of the attribute for 1 on the command line: 1e9 bytes for 1 GB.
        limits: Limits of the attribute; None if the class of the attribute checks them.
        shown: Default in the help, in words; empty for the value of the default.
        auto: Default with `--auto`, as on the command line; None for the same as without it.
        only_with: Option without which this one has no effect; empty for none.
        tets: Whether the option decides the tetrahedra, which are stored by it.
        page: Whether a visitor who brings a file chooses it on the page.
        chosen: Whether `--auto` may choose it.
    """

    name: str
    help: str
    at: str = ""
    default: Any = None
    kind: type | None = None
    optional: bool = False
    unit: float = 1.0
    limits: Limits | None = None
    shown: str = ""
    auto: Any = None
    only_with: str = ""
    tets: bool = False
    page: bool = False
    chosen: bool = False

    @property
    def flag(self) -> str:
        """The option on a command line."""
        return f"--{self.name.replace('_', '-')}"

    @property
    def attribute(self) -> str:
        """Attribute of an `ObjectFile` that holds the value."""
        return self.at or self.name

    @property
    def absent(self) -> Any:
        """Value on the command line if the option is not given."""
        return None if self.optional else self.default

    @property
    def hint(self) -> Any:
        """Type of a value on the command line, as an annotation."""
        kind: Any = list[str] if self.kind is tuple else self.kind
        return kind | None if self.optional else kind

    @property
    def table_hint(self) -> Any:
        """Type of a value in a table of a file, as an annotation."""
        return self.hint

    def value(self, source: object) -> Any:
        """The value that an `ObjectFile` has."""
        return attrgetter(self.attribute)(source)

    def read(self, given: Any) -> dict[str, Any]:
        """Read a given value; returns values by their attributes.

        Raises:
            SettingError: The value is not valid.
            TypeError, ValueError, OverflowError: The value is of another type.
        """
        value = self.typed(given)
        return {self.attribute: value if self.unit == 1.0 else self.unit * value}

    def typed(self, value: Any) -> Any:
        """Return a value, such as one of a JSON text, in the type of the option.

        Raises:
            TypeError, ValueError, OverflowError: The value is of another type.
        """
        assert self.kind is not None
        return tuple(str(text) for text in value) if self.kind is tuple else self.kind(value)

    def given(self, source: object) -> Any:
        """The value of an `ObjectFile` as it would be given; None or empty for no value."""
        value = self.value(source)
        if self.kind is tuple:
            return list(value)
        return value if self.unit == 1.0 else value / self.unit

    def check(self, source: object) -> None:
        """Check the value of an `ObjectFile` against the limits.

        Raises:
            SettingError: The value is out of its range.
        """
        limits, value = self.limits, self.value(source)
        if limits is None or (limits.zero and value == 0):
            return
        if not limits.least <= value <= limits.limit:
            reported = value if self.unit == 1.0 else value / self.unit
            raise SettingError(self.flag, limits.reported.format(reported), limits.words)


@dataclass(frozen=True, slots=True)
class PartOption(Option):
    """An option with a number for the object, and others for its parts: `5e3`, `tumour=60e3`.

    Args:
        parts: Attribute that holds the numbers of the parts, by their names.
        every: Attribute that says that each part has to have a number of its own, since there is
            none for the object; empty if there is no such attribute.
    """

    kind: type | None = tuple
    optional: bool = True
    parts: str = ""
    every: str = ""

    @property
    def table_hint(self) -> Any:
        """Type of a value in a table of a file: also the number for the object alone."""
        return list[str] | float | None

    def read(self, given: Any) -> dict[str, Any]:
        """Read a number, or texts; returns values by their attributes.

        Raises:
            SettingError: A text has no number, or two numbers are for the object.
            TypeError: The value is of another type.
        """
        texts = [repr(given)] if isinstance(given, int | float) else [str(text) for text in given]
        number, named = parse_values(self.flag, texts)
        found: dict[str, Any] = {} if number is None else {self.attribute: number}
        found[self.parts] = named
        if self.every:
            found[self.every] = bool(named) and number is None
        return found

    def typed(self, value: Any) -> Any:
        """Return the number for the object; raises TypeError or ValueError where it is none."""
        return float(value)

    def given(self, source: object) -> Any:
        """The texts for the numbers of an `ObjectFile`; empty if it has none."""
        number = self.value(source)
        if self.every and attrgetter(self.every)(source):
            number = None
        own = [] if number is None else [repr(number)]
        return own + [f"{name}={value!r}" for name, value in attrgetter(self.parts)(source)]


def parse_values(option: str, texts: Sequence[str]) -> tuple[float | None, Named]:
    """Read texts like `20e3` and `tumour=60e3`: the value without a name, if any, and the others.

    Raises:
        SettingError: A text has no number, or two values have no name.
    """
    rest: float | None = None
    named: list[tuple[str, float]] = []
    for text in texts:
        name, equals, number = text.rpartition("=")
        try:
            value = float(number)
        except ValueError:
            raise SettingError(option, repr(text), "a number, or NAME=number") from None
        if equals and not name.strip():
            raise SettingError(option, repr(text), "NAME=number")
        if equals:
            named.append((name.strip(), value))
        elif rest is not None:
            raise SettingError(option, f"{rest:g} and {value:g}", "once without a name")
        else:
            rest = value
    return rest, tuple(named)


def words_of(option: Option, given: Any) -> list[str]:
    """Words of a command line for a given value; none for no value."""
    if given is None or given is False or given == "":
        return []
    if given is True:
        return [option.flag]
    values: list[Any] = given if option.kind is tuple else [given]
    return [
        word
        for value in values
        for word in (option.flag, str(value) if isinstance(value, str | Path) else repr(value))
    ]
