"""The folder of what can be made anew: files of arrays under the key of what they come from.

It is bounded: beyond its limit the files that were not used for longest go. A file that is damaged
is made anew, with a word; a folder that cannot be written costs time, and nothing else.
"""

from __future__ import annotations

import contextlib
import hashlib
import logging
import os
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy.typing as npt

from cohaptic.errors import BodyError, SettingError
from cohaptic_server.objects.store.array_file import load_arrays, save_arrays

SUFFIX = ".arrays"
LIMIT = 20.0  # GB, unless COHAPTIC_CACHE_GB says otherwise

_LOG = logging.getLogger(__name__)


def folder() -> Path:
    """Where this system keeps what can be made anew; COHAPTIC_CACHE chooses another place."""
    chosen = os.environ.get("COHAPTIC_CACHE")
    if chosen:
        return Path(chosen)
    home = Path.home()
    if sys.platform == "win32":
        base = Path(os.environ.get("LOCALAPPDATA") or home / "AppData/Local")
    elif sys.platform == "darwin":
        base = home / "Library/Caches"
    else:
        base = Path(os.environ.get("XDG_CACHE_HOME") or home / ".cache")
    return base / "cohaptic"


def place(*content: bytes) -> Path:
    """File of what is made of `content` and nothing else."""
    digest = hashlib.sha256()
    for part in content:
        digest.update(len(part).to_bytes(8, "little"))
        digest.update(part)
    return folder() / f"{digest.hexdigest()[:32]}{SUFFIX}"


def fetch(where: Path, what: str, *, mapped: bool = True) -> dict[str, npt.NDArray[Any]] | None:
    """Stored arrays; None where there are none that can be read.

    Args:
        where: From `place`.
        what: For people, when they are damaged.
        mapped: As in `load_arrays`.
    """
    try:
        found = load_arrays(where, mapped=mapped)
    except FileNotFoundError:
        return None
    except (OSError, BodyError, ValueError, KeyError, TypeError) as error:
        damaged(what, error)
        return None
    with contextlib.suppress(OSError):
        os.utime(where)  # used now
    return found


def damaged(what: str, error: Exception) -> None:
    """Say that something stored is made anew, and why."""
    _LOG.warning("the stored %s cannot be used and is made anew (%s)", what, error)


def keep(where: Path, what: str, arrays: Mapping[str, npt.NDArray[Any]]) -> None:
    """Store arrays, and let go what was not used for longest."""
    try:
        where.parent.mkdir(parents=True, exist_ok=True)
        make_room(where.parent, sum(array.nbytes for array in arrays.values()))
        save_arrays(where, arrays)
    except OSError as error:
        _LOG.warning("the %s was not stored, the next start takes as long (%s)", what, error)


def limit() -> float:
    """Of the folder [bytes]."""
    told = os.environ.get("COHAPTIC_CACHE_GB", "")
    try:
        found = float(told or LIMIT)
    except ValueError:
        found = -1.0
    if not 0.0 <= found <= 1e6:
        raise SettingError("COHAPTIC_CACHE_GB", repr(told), "a number of gigabytes, 0 to 1e6")
    return 1e9 * found


def make_room(where: Path, needed: int) -> None:
    """Delete what was not used for longest, until `needed` more bytes are within the limit.

    Raises:
        OSError: More is needed than the limit.
    """
    allowed = limit()
    if needed > allowed:
        raise OSError(f"{needed / 1e9:.3g} GB; COHAPTIC_CACHE_GB allows {allowed / 1e9:g}")
    kinds = (SUFFIX, ".part", ".npz")  # half written; of versions before this one
    found = [(path.stat(), path) for kind in kinds for path in where.glob(f"*{kind}")]
    total = sum(stat.st_size for stat, _ in found)
    for stat, path in sorted(found, key=lambda entry: entry[0].st_mtime):
        if total + needed <= allowed:
            break
        path.unlink(missing_ok=True)
        total -= stat.st_size
