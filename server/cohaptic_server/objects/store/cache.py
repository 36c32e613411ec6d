"""A folder of array files with a size limit, named by the hash of what each was computed from.

If the folder exceeds its limit, the least recently used files are deleted. A damaged file is
computed again, with a warning. If the folder cannot be written, the next start computes the file
again; this is an error only after a call of `insist`.
"""

from __future__ import annotations

import contextlib
import hashlib
import logging
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy.typing as npt
from platformdirs import user_cache_path

from cohaptic.clock import SystemClock
from cohaptic.errors import BodyError, CohapticError, SettingError
from cohaptic.written import at_home
from cohaptic_server.objects.store.array_file import load_arrays, save_arrays

SUFFIX = ".arrays"
DEFAULT_LIMIT_GB = 20.0  # unless COHAPTIC_CACHE_GB is set

_LOG = logging.getLogger(__name__)
_insisting = False


class UnkeptError(CohapticError):
    """A prepared object cannot be stored."""


def insist() -> None:
    """Raise an error from now on, instead of a warning, if this process cannot store an entry.

    A process that prepares an object for another one calls this: without the entry the other
    process would have to repeat the preparation.
    """
    global _insisting
    _insisting = True


def cache_folder() -> Path:
    """Folder of the cache: COHAPTIC_CACHE, or `cohaptic` in the system's folder for caches."""
    chosen = os.environ.get("COHAPTIC_CACHE")
    if chosen:
        return at_home(Path(chosen))
    # Without `opinion` Windows gets %LOCALAPPDATA%\cohaptic, where earlier versions stored entries.
    return user_cache_path("cohaptic", appauthor=False, opinion=False)


def entry_path(*content: bytes) -> Path:
    """Path of the entry whose arrays are computed from `content` alone."""
    digest = hashlib.sha256()
    for part in content:
        digest.update(len(part).to_bytes(8, "little"))
        digest.update(part)
    return cache_folder() / f"{digest.hexdigest()[:32]}{SUFFIX}"


def load_entry(
    path: Path, label: str, *, mapped: bool = True, under: str = ""
) -> dict[str, npt.NDArray[Any]] | None:
    """Load the arrays of an entry; None if there is no intact entry.

    Args:
        path: Path from `entry_path`.
        label: Name of the content in a warning.
        mapped: As in `load_arrays`.
        under: As in `load_arrays`.
    """
    try:
        arrays = load_arrays(path, mapped=mapped, under=under)
    except FileNotFoundError:
        return None
    except (OSError, BodyError, ValueError, KeyError, TypeError) as error:
        warn_unusable(label, error)
        return None
    # The time of the last use decides which entries are deleted first. The time of the last change
    # is kept: it shows whether a file has been written to while it is mapped.
    clock = SystemClock()
    used = round(1e9 * (clock.now() + clock.to_wall()))
    with contextlib.suppress(OSError):
        os.utime(path, ns=(used, path.stat().st_mtime_ns))
    return arrays


def warn_unusable(label: str, error: Exception) -> None:
    """Warn that a stored entry cannot be used and is computed again, with the error."""
    _LOG.warning("the stored %s cannot be used and is made anew (%s)", label, error)


def save_entry(path: Path, label: str, arrays: Mapping[str, npt.NDArray[Any]]) -> None:
    """Store arrays, and first delete least recently used entries if the limit requires it.

    An entry that cannot be written is left out with a warning.

    Args:
        path: Path from `entry_path`.
        label: Name of the content in a warning.
        arrays: As in `save_arrays`.

    Raises:
        UnkeptError: The entry cannot be written, and this process has called `insist`.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        make_room(path.parent, sum(array.nbytes for array in arrays.values()))
        save_arrays(path, arrays)
    except OSError as error:
        if _insisting:
            why = error.strerror or "no more of it fits"
            raise UnkeptError(f"this server cannot keep what was prepared: {why}") from error
        _LOG.warning("the %s was not stored, the next start takes as long (%s)", label, error)


def cache_limit() -> float:
    """Largest size of the folder [bytes].

    Raises:
        SettingError: COHAPTIC_CACHE_GB is not a number, or out of range.
    """
    setting = os.environ.get("COHAPTIC_CACHE_GB", "")
    try:
        gigabytes = float(setting or DEFAULT_LIMIT_GB)
    except ValueError:
        gigabytes = -1.0
    if not 0.0 <= gigabytes <= 1e6:
        raise SettingError("COHAPTIC_CACHE_GB", repr(setting), "a number of gigabytes, 0 to 1e6")
    return 1e9 * gigabytes


def make_room(folder: Path, needed: int) -> None:
    """Delete the least recently used files until `needed` more bytes fit into the limit.

    Args:
        folder: The folder of the cache.
        needed: Size of the next entry [bytes].

    Raises:
        OSError: The next entry alone exceeds the limit.
    """
    limit = cache_limit()
    if needed > limit:
        raise OSError(f"{needed / 1e9:.3g} GB; COHAPTIC_CACHE_GB allows {limit / 1e9:g}")
    suffixes = (SUFFIX, ".part", ".npz")  # .part: half written; .npz: of earlier versions
    files = [(path.stat(), path) for suffix in suffixes for path in folder.glob(f"*{suffix}")]
    total = sum(stat.st_size for stat, _ in files)
    for stat, path in sorted(files, key=lambda entry: entry[0].st_atime):
        if total + needed <= limit:
            break
        path.unlink(missing_ok=True)
        total -= stat.st_size
