"""Mark files as in use, and remove those that ended processes, even killed ones, left behind.

Each process that has such a file open holds a lock on the file, and the system releases the lock
when the process ends. A stored process number would not be reliable, since another process may
have that number by now. An ended process left a file behind if no process has locked that file. On
systems without such locks the module removes nothing.
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
    """Mark an open file as in use: lock it until its last descriptor and mapping are closed.

    Args:
        file: Descriptor of the file.
    """
    if sys.platform != "win32":
        import fcntl

        with contextlib.suppress(OSError):  # the file system may have no locks
            fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)


def take(file: int) -> bool | None:
    """Lock an open file for this descriptor alone, until it is closed.

    Args:
        file: Descriptor of the file.

    Returns:
        Whether no other has locked it; None where there are no locks, as on Windows.
    """
    if sys.platform == "win32":
        return None
    import fcntl

    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:  # the file system may have no locks
        return None
    return True


def remove_leftovers(folder: Path, prefix: str, suffix: str, now: float, beside: str = "") -> int:
    """Remove this user's files that no process has locked any more, and return their number.

    Args:
        folder: Folder of the files.
        prefix: Prefix of the files' names.
        suffix: Suffix of the files' names.
        now: Unix time [s].
        beside: Suffix that, appended to a file's whole name, names a file or folder to remove with
            that file; empty for none.
    """
    if sys.platform == "win32":
        return 0
    removed = 0
    with contextlib.suppress(OSError):  # the folder itself may not be readable
        for path in folder.glob(f"{prefix}*{suffix}"):
            removed += _is_left(path, now) and _remove(path, Path(f"{path}{beside}"))
    return removed


def _remove(path: Path, along: Path) -> bool:
    """Remove `path` and `along`, which may be the same; return whether neither exists any more."""
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
    """Return whether `path` is a file of this user, older than `_MADE`, without a lock."""
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
