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
    """Decode text from UTF-8, or by its byte order mark; CR LF becomes a line feed.

    Raises:
        UnicodeDecodeError: The data are not text in that encoding.
    """
    for mark, encoding in _MARKS:
        if data.startswith(mark):
            return data[len(mark) :].decode(encoding).replace("\r\n", "\n")
    return data.decode().replace("\r\n", "\n")


def at_home(path: Path) -> Path:
    """The path with `~` replaced by the home folder.

    Raises:
        SettingError: The home folder is not known.
    """
    try:
        return path.expanduser()
    except RuntimeError as error:
        raise SettingError("path", path, "one without ~, since that home is not known") from error
