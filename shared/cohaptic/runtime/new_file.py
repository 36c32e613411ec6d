"""Write a file of results so that it replaces no other file, and is either whole or not there.

The content goes to a file beside the one that is wanted, which takes its name when all of it is on
the disk. No step of this replaces a file, also none that appeared meanwhile, unless the user has
wished it. A device or a pipe, such as /dev/stdout, holds nothing that could be lost, and is written
as it is.
"""

from __future__ import annotations

import contextlib
import os
import secrets
from collections.abc import Callable
from pathlib import Path
from typing import BinaryIO

from cohaptic.errors import OutputError

# Names of open files, which may be the file of a redirection: what is in that must stay.
_OPEN_FILES = tuple(map(Path, ("/dev/stdout", "/dev/stderr", "/dev/fd", "/proc")))


class AppearedMeanwhile(OutputError):
    """Another file has taken the name of a finished file, which is kept beside it.

    Args:
        path: The name that both wanted.
        written: Path under which the finished file is kept.
    """

    def __init__(self, path: Path, written: Path) -> None:
        problem = "another file of this name appeared meanwhile, and was not replaced"
        super().__init__(path, problem, f"this one is kept as {written}")
        self.written = written


def is_stream(path: Path) -> bool:
    """Return whether a path leads to a device, a pipe or an open file of this process."""
    if any(path.is_relative_to(name) for name in _OPEN_FILES):
        return True
    return path.exists() and not path.is_file() and not path.is_dir()


def real(path: Path) -> Path:
    """Return a path without symbolic links; unlike `Path.resolve`, also where they form a ring."""
    return Path(os.path.realpath(path))


def name_beside(path: Path) -> str:
    """Return the begin of a path's name, to which others may be added for a file beside it.

    A name may have 255 bytes on most systems.
    """
    return os.fsencode(path.name)[:200].decode(errors="ignore")


def write_new(path: Path, write: Callable[[BinaryIO], object], *, overwrite: bool) -> None:
    """Write a file beside a path, and give it that name when it is whole and on the disk.

    Args:
        path: Path of the file; of a symbolic link, the file that it leads to is meant.
        write: Function that writes the content to the file that it is given.
        overwrite: Whether to replace a file of that name.

    Raises:
        AppearedMeanwhile: There is a file of that name, and `overwrite` is false.
        OutputError: The file cannot be written, as on a full disk; no part of it remains.
    """
    try:
        if is_stream(path):
            with path.open("ab") as stream:
                write(stream)
        else:
            _write_file(real(path), write, overwrite=overwrite)
    except OSError as error:
        raise OutputError(path, f"it cannot be written ({error.strerror or error})") from error


def _write_file(path: Path, write: Callable[[BinaryIO], object], *, overwrite: bool) -> None:
    """Write a file beside a path, and give it that name.

    Raises:
        AppearedMeanwhile: There is a file of that name, and `overwrite` is false.
        OSError: The file cannot be written; no part of it remains.
    """
    part = path.with_name(f"{name_beside(path)}.{secrets.token_hex(4)}.tmp")
    with part.open("xb") as file:
        try:
            write(file)
            file.flush()
            os.fsync(file.fileno())
        except BaseException:
            with contextlib.suppress(OSError):
                part.unlink()
            raise
    try:
        _publish(part, path, overwrite=overwrite)
    except FileExistsError as error:
        raise AppearedMeanwhile(path, part) from error


def _publish(part: Path, path: Path, *, overwrite: bool) -> None:
    """Give a file its name.

    Raises:
        FileExistsError: The name is taken, and must not be replaced; `part` remains.
        OSError: The name cannot be given; `part` does not remain.
    """
    try:
        if overwrite:
            os.replace(part, path)
        else:
            _rename_to_new(part, path)
    except FileExistsError:
        raise
    except OSError:
        with contextlib.suppress(OSError):
            part.unlink()
        raise
    if hasattr(os, "O_DIRECTORY"):  # so that the name, too, outlives a loss of power
        with contextlib.suppress(OSError):  # some file systems cannot sync a folder
            folder = os.open(path.parent, os.O_RDONLY | os.O_DIRECTORY)
            try:
                os.fsync(folder)
            finally:
                os.close(folder)


def _rename_to_new(part: Path, path: Path) -> None:
    try:
        os.link(part, path)  # fails if the name is taken, in one step
    except FileExistsError:
        raise
    except OSError:
        # A file system without hard links: take the name by an empty file, and replace that.
        os.close(os.open(path, os.O_CREAT | os.O_EXCL | os.O_WRONLY))
        try:
            os.replace(part, path)
        except OSError:
            path.unlink()
            raise
    else:
        part.unlink()
