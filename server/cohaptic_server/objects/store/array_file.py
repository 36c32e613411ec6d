"""Stores named arrays in one flat file, which is mapped into memory without a copy.

    magic, length and CRC of the header    24 bytes
    header, JSON                           type, shape, order, offset and checksums of each array
    data                                   each array at a multiple of 64 bytes

A checksum is the sum of the 64-bit words of one piece of an array: it is computed as fast as the
memory is read. Loading runs no code from the file. The form was compared with a folder of .npy
files by measurement (docs/decisions/0023).
"""

from __future__ import annotations

import errno
import json
import mmap
import os
import shutil
import struct
import tempfile
import zlib
from collections.abc import Mapping
from io import BufferedReader
from math import prod
from pathlib import Path
from typing import IO, Any

import numpy as np
import numpy.typing as npt

from cohaptic.errors import BodyError

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
    if end + _DISK_RESERVE > shutil.disk_usage(path.parent).free:
        raise OSError(errno.ENOSPC, f"no room for {end / 1e9:.3g} GB on the disk", str(path.parent))
    file = tempfile.NamedTemporaryFile(dir=path.parent, suffix=".part", delete=False)
    try:
        with file:
            _write(file, header, flattened)
        os.replace(file.name, path)
    except BaseException:
        Path(file.name).unlink(missing_ok=True)
        raise


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
