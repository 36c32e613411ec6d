"""Reads a duration from the command line, such as 10m."""

from __future__ import annotations

import re

from cohaptic.errors import SettingError

_UNITS = {"s": 1.0, "m": 60.0, "h": 3600.0, "d": 86400.0}
_LONGEST = 400 * 86400.0  # s; a key is rotated sooner


def seconds_of(option: str, said: str, least: float = 1.0) -> float:
    """Convert the duration in the text of an option to seconds [s].

    Args:
        option: Name of the option, for the error.
        said: Text of the option, such as 10m.
        least: Shortest duration that is allowed [s].

    Raises:
        SettingError: The text is no duration, or the duration is too short or too long.
    """
    match = re.fullmatch(r"([0-9]{1,6}(?:\.[0-9]{1,3})?)([smhd])", said)
    seconds = float(match[1]) * _UNITS[match[2]] if match else -1.0
    if not least <= seconds <= _LONGEST:
        limit = f"from {least:g}s to 400d: 30s, 10m, 12h, 7d"
        raise SettingError(option, repr(said[:60]), limit)
    return seconds
