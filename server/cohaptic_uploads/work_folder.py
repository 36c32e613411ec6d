"""Makes and removes the temporary folder of an upload.

A worker that is killed cannot remove its files, so the server owns the folder and removes it after
the worker has ended. If the server itself was killed, the next server removes the folder.
"""

from __future__ import annotations

import contextlib
import os
import shutil
import stat
import tempfile
from pathlib import Path

from cohaptic.clock import SystemClock
from cohaptic.runtime.owned_files import own, remove_leftovers

_PREFIX, _SUFFIX, _BESIDE = "cohaptic-upload-", ".lock", ".files"


class WorkFolder:
    """A new folder that this process owns, in the system's folder for temporary files.

    Raises:
        OSError: The folder cannot be made.
    """

    def __init__(self) -> None:
        self._owner, name = tempfile.mkstemp(prefix=_PREFIX, suffix=_SUFFIX)
        own(self._owner)
        self._lock, self.path = Path(name), Path(name + _BESIDE)
        try:
            self.path.mkdir(mode=0o700)
        except OSError:
            self.close()
            raise

    def close(self) -> None:
        """Remove the folder and its content, which no process may use any more."""
        shutil.rmtree(self.path, ignore_errors=True)
        os.close(self._owner)
        if not self.path.exists():  # otherwise the lock stays, so that a later server finds both
            self._lock.unlink(missing_ok=True)


def remove_abandoned() -> int:
    """Remove folders of killed servers that are at least a minute old; returns their number."""
    clock = SystemClock()
    now = clock.now() + clock.to_wall()
    return remove_leftovers(_parent(), _PREFIX, _SUFFIX, now, beside=_BESIDE)


def bytes_in_work(least: int) -> int:
    """Disk space that the uploads of all servers of this system user take [bytes].

    Args:
        least: Space that each upload counts at least, since it may still write its file [bytes].
    """
    return sum(
        max(least, _held(folder))
        for folder in _parent().glob(f"{_PREFIX}*{_SUFFIX}{_BESIDE}")
        if _is_own_folder(folder)
    )


def _is_own_folder(path: Path) -> bool:
    """Whether a path is a folder of this user, and not a link that another user has put there."""
    try:
        found = os.lstat(path)
    except OSError:  # gone meanwhile
        return False
    return stat.S_ISDIR(found.st_mode) and found.st_uid == getattr(os, "getuid", lambda: 0)()


def _held(folder: Path) -> int:
    total = 0
    for inside, _, names in os.walk(folder):
        for name in names:
            with contextlib.suppress(OSError):  # gone meanwhile
                total += os.lstat(Path(inside) / name).st_size
    return total


def _parent() -> Path:
    return Path(tempfile.gettempdir())
