"""Reads a span of time from the command line, such as 10m."""

from __future__ import annotations

import re

from cohaptic.errors import SettingError

_UNITS = {"s": 1.0, "m": 60.0, "h": 3600.0, "d": 86400.0}
_LONGEST = 400 * 86400.0  # s; a key is rotated sooner


def seconds_of(option: str, said: str, least: float = 1.0) -> float:
    """A span of time [s].

    Args:
        option: Name of the option, for the error.
        said: Value of the option.
        least: Shortest span that is allowed [s].

    Raises:
        SettingError: The value is no span of time, or too short or too long.
    """
    match = re.fullmatch(r"([0-9]{1,6}(?:\.[0-9]{1,3})?)([smhd])", said)
    seconds = float(match[1]) * _UNITS[match[2]] if match else -1.0
    if not least <= seconds <= _LONGEST:
        limit = f"from {least:g}s to 400d: 30s, 10m, 12h, 7d"
        raise SettingError(option, repr(said[:60]), limit)
    return seconds
