"""Files and paths as people and their editors write them."""

from __future__ import annotations

import codecs
from pathlib import Path

from cohaptic.errors import SettingError

_MARKS = (
    (codecs.BOM_UTF8, "utf-8"),
    (codecs.BOM_UTF16_LE, "utf-16-le"),
    (codecs.BOM_UTF16_BE, "utf-16-be"),
)


def text_of(data: bytes) -> str:
    """A text in UTF-8, or with the byte order mark of what it is in; lines end with a line feed.

    Raises:
        UnicodeDecodeError: It is none.
    """
    for mark, encoding in _MARKS:
        if data.startswith(mark):
            return data[len(mark) :].decode(encoding).replace("\r\n", "\n")
    return data.decode().replace("\r\n", "\n")


def at_home(path: Path) -> Path:
    """A path whose `~` is the home folder.

    Raises:
        SettingError: There is no such home.
    """
    try:
        return path.expanduser()
    except RuntimeError as error:
        raise SettingError("path", path, "one without ~, since that home is not known") from error
