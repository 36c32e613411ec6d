"""A folder of array files with a size limit, each named by the hash of the content it came from.

An array file holds named arrays, and is mapped into memory without a copy:

    magic, length and CRC of the header    24 bytes
    header, JSON                           type, shape, order, offset and checksums of each array
    data                                   each array at a multiple of 64 bytes

A checksum is the sum of the 64-bit words of one piece of an array: it is computed as fast as the
memory is read. Loading runs no code from the file. The form was compared with a folder of .npy
files by measurement (docs/design/objects.md).

If the folder exceeds its limit, the least recently used files are deleted. A damaged file is
computed again, with a warning. If the folder cannot be written, the next start computes the file
again; this is an error only within `insisting`. Machines may share entries (`shared`).
"""

from __future__ import annotations

import contextlib
import errno
import hashlib
import json
import logging
import mmap
import os
import shutil
import struct
import tempfile
import zlib
from collections.abc import Generator, Mapping
from functools import cache
from io import BufferedReader
from math import prod
from pathlib import Path
from typing import IO, Any

import numpy as np
import numpy.typing as npt
from platformdirs import user_cache_path

from cohaptic.clock import SystemClock
from cohaptic.errors import BodyError, CohapticError, SettingError
from cohaptic.written import at_home
from cohaptic_server.objects.store import shared

Array = npt.NDArray[Any]

_MAGIC = b"cohaptA1"
_START = struct.Struct("<8sQII")  # magic, length and CRC of the header, padding
_ALIGN = 64
_PIECE = 2**24  # bytes covered by one checksum
_TYPES = ("<f8", "<f4", "<i8", "<i4", "|b1", "|u1")
_DISK_RESERVE = 2**28  # bytes of the disk that are left free


def save_arrays(path: Path, arrays: Mapping[str, Array]) -> None:
    """Write arrays to a file atomically: a reader sees the whole file or none.

    Args:
        path: Path of the file, in a folder that exists.
        arrays: Arrays by name; Fortran order is kept.

    Raises:
        OSError: The file cannot be written, or the disk is nearly full.
        BodyError: An array is of a type that cannot be stored.
    """
    index: dict[str, list[object]] = {}
    flattened: list[Array] = []
    end = 0
    for name, array in arrays.items():
        is_fortran = array.ndim > 1 and array.flags.f_contiguous and not array.flags.c_contiguous
        flat = np.ascontiguousarray(array.T if is_fortran else array).reshape(-1)
        kind = flat.dtype.newbyteorder("<").str
        if kind not in _TYPES:
            raise BodyError(f"array {name!r} is of type {kind}; stored are: {' '.join(_TYPES)}")
        flat = flat.astype(kind, copy=False)
        order = "F" if is_fortran else "C"
        index[name] = [kind, list(array.shape), order, end, _checksums(flat.view(np.uint8))]
        flattened.append(flat)
        end = _aligned(end + flat.nbytes)
    header = json.dumps({"arrays": index, "bytes": end}).encode()
    _check_disk(path.parent, end)
    file = tempfile.NamedTemporaryFile(dir=path.parent, suffix=".part", delete=False)
    try:
        with file:
            _write(file, header, flattened)
        os.replace(file.name, path)
    except BaseException:
        Path(file.name).unlink(missing_ok=True)
        raise


def _check_disk(folder: Path, needed: int) -> None:
    if needed + _DISK_RESERVE > shutil.disk_usage(folder).free:
        raise OSError(errno.ENOSPC, f"no room for {needed / 1e9:.3g} GB on the disk", str(folder))


def load_arrays(path: Path, *, mapped: bool = True, under: str = "") -> dict[str, Array]:
    """Load the arrays of a file that `save_arrays` wrote, by name.

    Args:
        mapped: Whether the arrays are read-only views of the mapped file; otherwise copies.
        under: Prefix of the names of arrays to load, which the result leaves out; arrays with
            other names are not read.

    Raises:
        OSError: The file cannot be read.
        BodyError: The file is of another form, or damaged.
    """
    with path.open("rb") as file:
        return read_arrays(file, path, mapped=mapped, under=under)


def read_arrays(
    file: BufferedReader, path: Path, *, mapped: bool = True, under: str = ""
) -> dict[str, Array]:
    """Load arrays, as `load_arrays` does, from a file open at its beginning; errors name `path`."""
    index, data_start = _index(file, path)
    index = {k.removeprefix(under): entry for k, entry in index.items() if k.startswith(under)}
    whole = None
    if mapped:
        # The views refer to the mapping: truncating the file while they are read ends this process.
        whole = mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ)
        if hasattr(mmap, "MADV_WILLNEED"):
            whole.madvise(mmap.MADV_WILLNEED)
    arrays: dict[str, Array] = {}
    for name, (kind, shape, order, offset, checksums) in index.items():
        count, start = prod(shape), data_start + offset
        if whole is not None:
            array: Array = np.frombuffer(whole, np.dtype(kind), count, start)
        else:
            array = np.empty(count, np.dtype(kind))
            file.seek(start)
            if file.readinto(array.view(np.uint8).data) != array.nbytes:
                raise BodyError(f"{path}: array {name!r} is cut off")
        if _checksums(array.view(np.uint8)) != checksums:
            raise BodyError(f"{path}: array {name!r} is damaged")
        arrays[name] = array.reshape(shape, order=order)
    return arrays


def _index(file: BufferedReader, path: Path) -> tuple[dict[str, Any], int]:
    """Description of each array by name, and the offset in the file at which the data begin.

    Raises:
        BodyError: The file is of another form, or damaged.
    """
    size = os.fstat(file.fileno()).st_size
    start = file.read(_START.size)
    if len(start) < _START.size:
        raise BodyError(f"{path}: {size} bytes are too few")
    magic, length, crc, _ = _START.unpack(start)
    if magic != _MAGIC or length > size:
        raise BodyError(f"{path}: not a file of arrays of this form")
    header = file.read(length)
    if zlib.crc32(header) != crc:
        raise BodyError(f"{path}: its header is damaged")
    content: dict[str, Any] = json.loads(header)
    data_start = _aligned(_START.size + length)
    if size != data_start + content["bytes"]:
        raise BodyError(f"{path}: {size} bytes, of {data_start + content['bytes']}")
    return content["arrays"], data_start


def _write(file: IO[bytes], header: bytes, arrays: list[Array]) -> None:
    file.write(_START.pack(_MAGIC, len(header), zlib.crc32(header), 0))
    file.write(header)
    file.write(bytes(_aligned(file.tell()) - file.tell()))
    for array in arrays:
        file.write(array.view(np.uint8).data)
        file.write(bytes(_aligned(array.nbytes) - array.nbytes))


def _checksums(data: npt.NDArray[np.uint8]) -> list[int]:
    """Sum of the 64-bit words of each piece modulo 2^64, the last word padded with zeros."""
    sums: list[int] = []
    for begin in range(0, len(data), _PIECE):
        piece = data[begin : begin + _PIECE]
        whole = len(piece) // 8 * 8
        rest = int.from_bytes(piece[whole:].tobytes(), "little")
        total = int(piece[:whole].view("<u8").sum(dtype=np.uint64)) + rest
        sums.append(total % 2**64)
    return sums


def _aligned(count: int) -> int:
    return -(-count // _ALIGN) * _ALIGN


SUFFIX = ".arrays"
DEFAULT_LIMIT_GB = 20.0  # unless COHAPTIC_CACHE_GB is set

_LOG = logging.getLogger(__name__)
_insisting = False


class UnkeptError(CohapticError):
    """A prepared object cannot be stored."""


@contextlib.contextmanager
def insisting() -> Generator[None, None, None]:
    """Context in which an entry that this process cannot store is an error instead of a warning.

    It is for a preparation whose aim is the entry: without it the next process would repeat all.
    """
    global _insisting
    before, _insisting = _insisting, True
    try:
        yield
    finally:
        _insisting = before


# Folder of the cache for an account that has none: below a file nothing can be made or found.
NOWHERE = Path(os.devnull, "cohaptic")
_NO_HOME = "this account has no home folder with a whole path; COHAPTIC_CACHE names another folder"


def cache_folder() -> Path:
    """Folder of the cache: COHAPTIC_CACHE, or `cohaptic` in the system's folder for caches.

    It is `NOWHERE` for an account whose home folder is not known, or is a relative path, which
    would be another folder for each program that is started elsewhere.
    """
    chosen = os.environ.get("COHAPTIC_CACHE")
    if chosen:
        return at_home(Path(chosen))
    # Without `opinion` Windows gets %LOCALAPPDATA%\cohaptic, and no folder "Cache" in it.
    try:
        folder = user_cache_path("cohaptic", appauthor=False, opinion=False)
    except RuntimeError:
        return NOWHERE
    return folder if folder.is_absolute() else NOWHERE


def entry_path(*content: bytes) -> Path:
    """Path of the entry whose arrays are computed from `content` alone."""
    digest = hashlib.sha256()
    for part in content:
        digest.update(len(part).to_bytes(8, "little"))
        digest.update(part)
    return cache_folder() / f"{digest.hexdigest()[:32]}{SUFFIX}"


def has_entry(path: Path, label: str) -> bool:
    """Whether an entry is stored here, or on the storage that machines share; then it is fetched.

    Args:
        path: Path from `entry_path`.
        label: Name of the content in the log.
    """
    return os.path.isfile(path) or shared.fetch(path, label, _make_room, load_arrays)


def load_entry(
    path: Path, label: str, *, mapped: bool = True, under: str = "", for_all: bool = True
) -> dict[str, npt.NDArray[Any]] | None:
    """Load the arrays of an entry; None if there is no intact entry.

    Args:
        path: Path from `entry_path`.
        label: Name of the content in a warning.
        mapped: As in `load_arrays`.
        under: As in `load_arrays`.
        for_all: Whether machines share it.
    """
    try:
        try:
            arrays = load_arrays(path, mapped=mapped, under=under)
        except (FileNotFoundError, NotADirectoryError):
            if not for_all or not has_entry(path, label):
                return None
            arrays = load_arrays(path, mapped=mapped, under=under)
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


def save_entry(
    path: Path, label: str, arrays: Mapping[str, npt.NDArray[Any]], *, for_all: bool = True
) -> None:
    """Store arrays, and first delete least recently used entries if the limit requires it.

    An entry that cannot be written is left out with a warning.

    Args:
        path: Path from `entry_path`.
        label: Name of the content in a warning.
        arrays: As in `save_arrays`.
        for_all: Whether machines share it.

    Raises:
        UnkeptError: The entry cannot be written, within `insisting`.
    """
    nowhere = path.parent == NOWHERE
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        make_room(path.parent, sum(array.nbytes for array in arrays.values()))
        save_arrays(path, arrays)
    except OSError as error:
        if _insisting:
            why = _NO_HOME if nowhere else error.strerror or str(error)
            raise UnkeptError(f"what was prepared cannot be kept: {why}") from error
        if nowhere:
            warn_once(f"nothing is stored, the next start takes as long: {_NO_HOME}")
        else:
            _LOG.warning("the %s was not stored, the next start takes as long (%s)", label, error)
        return
    if for_all:
        shared.send(path, label)


@cache
def warn_once(words: str) -> None:
    """Log a warning, once for each text in a process."""
    _LOG.warning("%s", words)


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
    suffixes = (SUFFIX, ".part")  # .part: half written
    files = list[tuple[os.stat_result, Path]]()
    for path in (path for suffix in suffixes for path in folder.glob(f"*{suffix}")):
        with contextlib.suppress(FileNotFoundError):  # another process has just renamed it
            files.append((path.stat(), path))
    total = sum(stat.st_size for stat, _ in files)
    for stat, path in sorted(files, key=lambda entry: entry[0].st_atime):
        if total + needed <= limit:
            break
        path.unlink(missing_ok=True)
        total -= stat.st_size


def _make_room(folder: Path, needed: int) -> None:
    make_room(folder, needed)
    _check_disk(folder, needed)
