"""The files that commands write for a person: one rule for all of them.

A command asks `new_output` for each of its files before it starts anything, and writes them at the
end of the work. A file that exists is refused at the start, unless the user adds --overwrite.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, BinaryIO

import typer

from cohaptic.errors import SettingError
from cohaptic.runtime.new_file import is_stream, real, write_new

# The option, the same for each command that writes a file.
Overwrite = Annotated[bool, typer.Option("--overwrite", help="Replace files that exist.")]


@dataclass(frozen=True, slots=True)
class Output:
    """A file that a command will write at the end of its work.

    Args:
        path: Path of the file.
        overwrite: Whether the file may replace another.
    """

    path: Path
    overwrite: bool = False

    def write(self, content: str | bytes) -> None:
        """Write the file, which is whole on the disk when this returns.

        Args:
            content: All of it; text becomes UTF-8.

        Raises:
            OutputError: The file cannot be written, or another appeared meanwhile.
        """
        data = content.encode() if isinstance(content, str) else content
        self.write_by(lambda file: file.write(data))

    def write_by(self, write: Callable[[BinaryIO], object]) -> None:
        """Write the file by a function that is given it, as `write` does.

        Raises:
            OutputError: As for `write`.
        """
        write_new(self.path, write, overwrite=self.overwrite)


def new_output(
    option: str, path: Path | None, suffix: str = "", *, overwrite: bool = False
) -> Output | None:
    """Return the file that a command will write, checked as far as possible before the work starts.

    Args:
        option: Option by which the user named the file, such as --json.
        path: Path of the file; None if no file is wanted.
        suffix: Required suffix of the file's name; empty for any.
        overwrite: Whether the file may replace another.

    Raises:
        SettingError: The file exists and must not be replaced, the suffix is wrong, the folder is
            missing, the path is a folder, or the file may not be written to.
    """
    if path is None:
        return None
    try:
        return _checked(option, path, suffix, overwrite=overwrite)
    except OSError as error:
        limit = f"a path that the system takes ({error.strerror or error})"
        raise SettingError(option, path, limit) from error


def _checked(option: str, path: Path, suffix: str, *, overwrite: bool) -> Output:
    """Return the file of `new_output`.

    Raises:
        SettingError: As for `new_output`.
        OSError: The system takes no such path.
    """
    kind = f"a file that ends with {suffix}" if suffix else "a file"
    if suffix and path.suffix.lower() != suffix:
        raise SettingError(option, path, kind)
    if not path.parent.is_dir():
        raise SettingError(option, path, f"{kind} in a folder that exists: not {path.parent}")
    if path.is_dir():
        raise SettingError(option, path, f"{kind}, and it is a folder")
    stream = is_stream(path)
    exists = path.exists() or real(path).is_symlink()  # a ring of links cannot be written, either
    if exists and not stream and not overwrite:
        limit = "a new file, and this one exists: choose another name, or replace it by --overwrite"
        raise SettingError(option, path, limit)
    # A file is replaced by another of its folder, which would not ask whether it may be written to.
    places = [path] if stream else [real(path).parent, *([path] if path.exists() else [])]
    if not all(os.access(place, os.W_OK) for place in places):
        raise SettingError(option, path, f"{kind} that may be written to")
    return Output(path, overwrite)
