"""Check the output file of a command before the work starts."""

from __future__ import annotations

import os
from pathlib import Path

from cohaptic.errors import SettingError


def check_output(option: str, path: Path | None, suffix: str = "") -> None:
    """Raise SettingError if a command could not write its output file at the end of the work.

    Args:
        option: Option by which the user named the file, such as --json.
        path: Path of the file; None if no file is wanted.
        suffix: Required suffix of the file's name; empty for any.

    Raises:
        SettingError: The suffix is wrong, the folder is missing, the path is a folder, or the file
            may not be written to.
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
