"""Mark files as in use, and remove those that ended processes, even killed ones, left behind.

Each process that has such a file open holds a lock on the file, and the system releases the lock
when the process ends. A stored process number would not be reliable, since another process may
have that number by now. A file without a lock was left behind. On systems without such locks
nothing is removed.
"""

from __future__ import annotations

import contextlib
import os
import shutil
import stat
import sys
from pathlib import Path

_MADE = 60.0  # s; a younger file may not be locked yet


def own(file: int) -> None:
    """Lock an open file until its last descriptor is closed and its last mapping is removed.

    Args:
        file: Descriptor of the file.
    """
    if sys.platform != "win32":
        import fcntl

        with contextlib.suppress(OSError):  # the file system may have no locks
            fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)


def remove_leftovers(folder: Path, prefix: str, suffix: str, now: float, beside: str = "") -> int:
    """Remove this user's files that no process has locked any more; returns their number.

    Args:
        folder: Folder of the files.
        prefix: Prefix of their names.
        suffix: Suffix of their names.
        now: Unix time [s].
        beside: Suffix that, appended to a file's whole name, names a file or folder to remove with
            the file; empty for none.
    """
    if sys.platform == "win32":
        return 0
    removed = 0
    with contextlib.suppress(OSError):  # the folder itself may not be readable
        for path in folder.glob(f"{prefix}*{suffix}"):
            removed += _is_left(path, now) and _remove(path, Path(f"{path}{beside}"))
    return removed


def _remove(path: Path, along: Path) -> bool:
    """Remove `path` and `along`, which may be the same; returns whether both are gone."""
    try:
        # `along` goes first: if that fails, `path` remains and the next clean-up tries again.
        if along.is_dir() and not along.is_symlink():
            shutil.rmtree(along)
        else:
            along.unlink(missing_ok=True)
        path.unlink(missing_ok=True)
    except OSError:  # the next file may be removed all the same
        return False
    return True


def _is_left(path: Path, now: float) -> bool:
    """Whether a path is a file of this user, older than `_MADE`, that no process has locked."""
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
