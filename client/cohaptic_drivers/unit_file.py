"""Reads the file of a unit: a short TOML file by which a person describes one device."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

from cohaptic.errors import SettingError
from cohaptic.written import at_home, text_of


def read_unit_file(path: str, longest: int) -> dict[str, Any]:
    """Return the values in a unit's file, by key.

    Args:
        path: Path of the file; `~` is the home folder.
        longest: Largest size of the file [bytes].

    Raises:
        SettingError: The file cannot be read, is too long, or is not TOML.
    """
    try:
        data = at_home(Path(path)).read_bytes()
        if len(data) > longest:
            raise SettingError("unit", path, f"at most {longest} bytes")
        return tomllib.loads(text_of(data))
    except OSError as error:
        raise SettingError("unit", path, f"a file that can be read ({error.strerror})") from error
    except ValueError as error:
        raise SettingError("unit", path, f"a TOML file ({error})") from error
