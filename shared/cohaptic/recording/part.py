"""The file of a recording in progress, `NAME.npz.part`, which belongs to one process.

The process holds a lock on the file, which the system takes away when the process ends, however it
ends. So a part without a lock is what a killed process has left behind: somebody's data, which no
recording may use the name of until it is finished or moved away.
"""

from __future__ import annotations

import contextlib
import os
import shlex
import shutil
import stat
import sys
import tempfile
from pathlib import Path

from cohaptic.errors import OutputError, SettingError
from cohaptic.runtime.new_file import name_beside, real
from cohaptic.runtime.owned_files import take

SUFFIX = ".part"


def part_of(path: Path) -> Path:
    """Return the path of the part of a recording, given that of its `.npz`."""
    return path.with_name(f"{path.name}{SUFFIX}")


def finish_command(part: Path) -> str:
    """Return the command that turns a part into a `.npz`."""
    return f"cohaptic recording --finish {shlex.quote(str(part))}"


def part_gone() -> FileNotFoundError:
    """Return the error for a part whose name no longer leads to it."""
    return FileNotFoundError(None, "somebody has removed or moved it or its folder")


class Part:
    """An open part that this process owns.

    Args:
        path: Its path.
        file: Its descriptor, which this object closes.
    """

    def __init__(self, path: Path, file: int) -> None:
        self.path = path
        self._file = file

    @classmethod
    def claim(cls, option: str, path: Path) -> Part:
        """Make the part of a new recording, or take an empty one over.

        Args:
            option: Option by which the user named the recording.
            path: Path of the `.npz`.

        Raises:
            SettingError: Another process records to it, a killed process has left rows in it, or it
                cannot be made.
        """
        part = part_of(real(path))
        try:
            try:
                made = cls(part, os.open(part, _FLAGS | os.O_CREAT | os.O_EXCL, 0o666))
                alone = take(made._file) is not False
            except FileExistsError:
                made = cls(part, os.open(part, _FLAGS))
                alone = stat.S_ISREG(os.fstat(made._file).st_mode) and bool(take(made._file))
        except OSError as error:
            limit = f"a file that can be written ({part.name}: {error.strerror or error})"
            raise SettingError(option, path, limit) from error
        if not (alone and made.is_there()):
            made.close()
            raise SettingError(option, path, "a file to which no other program is recording")
        if made.size():
            made.close()
            limit = (
                f"another name, or first finish the recording that a killed program has left in"
                f" {part.name}: {finish_command(part)}"
            )
            raise SettingError(option, path, limit)
        return made

    @classmethod
    def new(cls, option: str, path: Path) -> Part:
        """Make a file that has its own name from the beginning, and that nobody has made yet.

        Args:
            option: Option by which the user named the file.
            path: Path of the file.

        Raises:
            SettingError: There is a file of that name, or it cannot be made.
        """
        path = real(path)
        try:
            made = cls(path, os.open(path, _FLAGS | os.O_CREAT | os.O_EXCL, 0o666))
        except FileExistsError as error:
            raise SettingError(
                option, path, "the name of a file that does not exist yet"
            ) from error
        except OSError as error:
            limit = f"a file that can be written ({error.strerror or error})"
            raise SettingError(option, path, limit) from error
        take(made._file)  # nobody else can have it: another program found no file to lock
        return made

    @classmethod
    def left(cls, path: Path) -> Part:
        """Take over a part that a killed process has left, to finish it.

        Raises:
            OutputError: Another process owns it, or it cannot be opened.
        """
        try:
            part = cls(path, os.open(path, _FLAGS))
        except OSError as error:
            raise OutputError(path, f"it cannot be opened ({error.strerror})") from error
        if take(part._file) is False:
            part.close()
            raise OutputError(path, "a program is still recording to it")
        return part

    def write(self, data: bytes) -> None:
        """Append bytes.

        Raises:
            OSError: They cannot be written, or not all of them; those that could be remain.
            FileNotFoundError: The name no longer leads to this file: somebody has removed or moved
                it or its folder.
        """
        rest = memoryview(data)
        while rest:
            rest = rest[os.write(self._file, rest) :]
        if not self.is_there():
            raise part_gone()

    def is_there(self) -> bool:
        """Return whether the name still leads to this file."""
        try:
            return os.path.samestat(os.stat(self.path), os.fstat(self._file))
        except OSError:
            return False

    def rescue(self) -> Path:
        """Copy the content, which has lost its name, to a new file; return the path of that.

        The system keeps the content of a removed file until the last process closes it.

        Raises:
            OSError: There is no room in the folder for temporary files.
        """
        suffix = f".npz{SUFFIX}" if self.path.suffix == SUFFIX else self.path.suffix
        name = name_beside(Path(self.path.name.removesuffix(suffix)))
        handle, path = tempfile.mkstemp(prefix=f"{name}-", suffix=suffix)
        with os.fdopen(handle, "wb") as copy, open(os.dup(self._file), "rb") as content:
            content.seek(0)
            shutil.copyfileobj(content, copy)
        return Path(path)

    def size(self) -> int:
        """Return its size [bytes]."""
        return os.fstat(self._file).st_size

    def sync(self) -> None:
        """Wait until all bytes are on the disk.

        Raises:
            OSError: They cannot be written.
        """
        os.fsync(self._file)

    def remove(self) -> None:
        """Remove the file, if its name still leads to it, and close it."""
        if self.is_there():
            with contextlib.suppress(OSError):
                if sys.platform == "win32":  # which removes no open file
                    self.close()
                # With the lock still held, as another program could take an empty part over.
                self.path.unlink()
        self.close()

    def close(self) -> None:
        """Close the file, and with that give up the lock."""
        if self._file >= 0:
            os.close(self._file)
            self._file = -1


# The flags of Windows and Linux, where the system knows them: bytes as they are, at the end always;
# not in child processes; and no link or pipe that has been put in the way.
_FLAGS = (
    os.O_RDWR
    | os.O_APPEND
    | getattr(os, "O_BINARY", 0)
    | getattr(os, "O_CLOEXEC", 0)
    | getattr(os, "O_NOFOLLOW", 0)
    | getattr(os, "O_NONBLOCK", 0)
)
