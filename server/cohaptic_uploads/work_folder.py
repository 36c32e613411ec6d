"""The folder in which an upload is worked on.

The worker is ended whatever it does, and removes nothing then: the folder is the server's, which
removes it once the worker is gone. That of a server which was ended itself has no owner any more,
and the next server removes it.
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
    """A new folder, in the system's for such, of this process.

    Attributes:
        path: Path of the folder.

    Raises:
        OSError: It cannot be made.
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
        """Remove it, with all that is in it; no process may work in it any more."""
        shutil.rmtree(self.path, ignore_errors=True)
        os.close(self._owner)
        if not self.path.exists():  # what could not be removed is found by its lock, later
            self._lock.unlink(missing_ok=True)


def remove_abandoned() -> int:
    """Remove the folders of servers that were killed, once they are a minute old; says how many."""
    clock = SystemClock()
    now = clock.now() + clock.to_wall()
    return remove_leftovers(_parent(), _PREFIX, _SUFFIX, now, beside=_BESIDE)


def bytes_in_work(least: int) -> int:
    """Room on the disk that the uploads of all servers of this user take [bytes].

    Args:
        least: That counts for each of them, which is still to write its file [bytes].
    """
    return sum(
        max(least, _held(folder))
        for folder in _parent().glob(f"{_PREFIX}*{_SUFFIX}{_BESIDE}")
        if _is_own_folder(folder)
    )


def _is_own_folder(path: Path) -> bool:
    """Others may put links and folders of such names into a place that all write to."""
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
