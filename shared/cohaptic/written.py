"""Decode text as editors save it, and expand `~` in paths as people type them."""

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
    """Decode text as UTF-8, or as its byte order mark says, and replace CR LF by a line feed.

    Raises:
        UnicodeDecodeError: The data are not valid in that encoding.
    """
    for mark, encoding in _MARKS:
        if data.startswith(mark):
            return data[len(mark) :].decode(encoding).replace("\r\n", "\n")
    return data.decode().replace("\r\n", "\n")


def at_home(path: Path) -> Path:
    """Return the path with a leading `~` replaced by the home folder.

    Raises:
        SettingError: The system does not know the home folder.
    """
    try:
        return path.expanduser()
    except RuntimeError as error:
        raise SettingError("path", path, "one without ~, since that home is not known") from error
