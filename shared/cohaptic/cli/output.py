"""A file that a command is to write: looked at before the work, and not after it."""

from __future__ import annotations

import os
from pathlib import Path

from cohaptic.errors import SettingError


def check_output(option: str, path: Path | None, suffix: str = "") -> None:
    """Refuse what could not be written at the end.

    Args:
        option: By which the user named it, such as --json.
        path: Path of the file; None where none is wanted.
        suffix: That its name has to end with; empty for any.

    Raises:
        SettingError: Its folder is not there or may not be written to, or it is a folder itself.
    """
    if path is None:
        return
    kind = f"a file that ends with {suffix}" if suffix else "a file"
    if suffix and path.suffix.lower() != suffix:
        raise SettingError(option, path, kind)
    if not path.parent.is_dir():
        raise SettingError(option, path, f"{kind} in a folder that exists: not {path.parent}")
    if path.is_dir():
        raise SettingError(option, path, f"{kind}, and it is a folder")
    if not os.access(path if path.exists() else path.parent, os.W_OK):
        raise SettingError(option, path, f"{kind} that may be written to")
