"""Files that live as long as the processes that use them, also where those are killed.

Each process that has such a file open holds a lock on it, which the system gives up with the
process; that is sure where the number of a process is not, which another one may have by now. A
file without a lock was left behind. Where the system has no such locks nothing is removed.
"""

from __future__ import annotations

import contextlib
import os
import shutil
import stat
import sys
from pathlib import Path

_MADE = 60.0  # s; a file so young may be one that is not locked yet


def own(file: int) -> None:
    """Hold the lock of an open file, until its last descriptor is closed; a mapping has one too.

    Args:
        file: Descriptor.
    """
    if sys.platform != "win32":
        import fcntl

        with contextlib.suppress(OSError):  # of a file system without locks
            fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)


def remove_leftovers(folder: Path, prefix: str, suffix: str, now: float, beside: str = "") -> int:
    """Remove this user's files that nobody owns any more; returns how many.

    Args:
        folder: Where they are.
        prefix: Prefix of their names.
        suffix: The same.
        now: Unix time [s].
        beside: Suffix of a file or a folder that goes with each, behind the whole name.
    """
    if sys.platform == "win32":
        return 0
    removed = 0
    with contextlib.suppress(OSError):  # of the folder itself
        for path in folder.glob(f"{prefix}*{suffix}"):
            removed += _is_left(path, now) and _remove(path, Path(f"{path}{beside}"))
    return removed


def _remove(path: Path, along: Path) -> bool:
    """Remove a file and what goes with it, which may be itself; whether both are gone."""
    try:
        # That goes first: should it not go, its owner's file says so to the next who looks.
        if along.is_dir() and not along.is_symlink():
            shutil.rmtree(along)
        else:
            along.unlink(missing_ok=True)
        path.unlink(missing_ok=True)
    except OSError:  # the next one may go all the same
        return False
    return True


def _is_left(path: Path, now: float) -> bool:
    """Whether it is a file of this user that no process holds."""
    if sys.platform == "win32":
        return False
    import fcntl

    try:
        file = os.open(path, os.O_RDWR | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC)
    except OSError:
        return False
    try:
        found = os.fstat(file)
        young = now - max(found.st_mtime, found.st_ctime) < _MADE
        if not stat.S_ISREG(found.st_mode) or found.st_uid != os.getuid() or young:
            return False
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        return False
    else:
        return True
    finally:
        os.close(file)
