"""Named arrays in one flat file, each where a memory map can use it as it is.

    magic, length and CRC of the header    24 bytes
    header, JSON                           of every array: type, shape, order, place, sums
    data                                   each array at a multiple of 64 bytes

The sums are those of the array's 64-bit words, one for each piece of it: checking them reads the
data as fast as the memory gives it, and a server reads all of it at the first touch anyway.
Nothing is read from such a file but numbers.
"""

from __future__ import annotations

import json
import mmap
import os
import shutil
import struct
import tempfile
import zlib
from collections.abc import Mapping
from math import prod
from pathlib import Path
from typing import IO, Any

import numpy as np
import numpy.typing as npt

from cohaptic.errors import BodyError

Array = npt.NDArray[Any]

_MAGIC = b"cohaptA1"
_START = struct.Struct("<8sQII")  # magic, length of the header, its CRC, nothing
_ALIGN = 64
_PIECE = 2**24  # bytes in one sum
_TYPES = ("<f8", "<f4", "<i8", "<i4", "|b1", "|u1")
_MARGIN = 2**28  # bytes of a disk that are left to others


def save_arrays(path: Path, arrays: Mapping[str, Array]) -> None:
    """Write at once or not at all.

    Args:
        path: Of the file; its folder must be there.
        arrays: By name; those that are stored by columns stay so.

    Raises:
        OSError: It cannot be written, or the disk is nearly full.
    """
    index: dict[str, list[object]] = {}
    flat: list[Array] = []
    end = 0
    for name, array in arrays.items():
        by_columns = array.ndim > 1 and array.flags.f_contiguous and not array.flags.c_contiguous
        line = np.ascontiguousarray(array.T if by_columns else array).reshape(-1)
        kind = line.dtype.newbyteorder("<").str
        if kind not in _TYPES:
            raise BodyError(f"array {name!r} is of type {kind}; stored are: {' '.join(_TYPES)}")
        line = line.astype(kind, copy=False)
        order = "F" if by_columns else "C"
        index[name] = [kind, list(array.shape), order, end, _sums(line.view(np.uint8))]
        flat.append(line)
        end = _aligned(end + line.nbytes)
    header = json.dumps({"arrays": index, "bytes": end}).encode()
    if end + _MARGIN > shutil.disk_usage(path.parent).free:
        raise OSError(f"{path.parent}: no room for {end / 1e9:.3g} GB")
    file = tempfile.NamedTemporaryFile(dir=path.parent, suffix=".part", delete=False)
    try:
        with file:
            _write(file, header, flat)
        os.replace(file.name, path)
    except BaseException:
        Path(file.name).unlink(missing_ok=True)
        raise


def load_arrays(path: Path, *, mapped: bool = True) -> dict[str, Array]:
    """Read what `save_arrays` wrote.

    Args:
        path: Of the file.
        mapped: Whether arrays stay in the file and are read-only, or are copied into memory.

    Raises:
        OSError: It cannot be read.
        BodyError: It is not what was written.
    """
    with path.open("rb") as file:
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
        told: dict[str, Any] = json.loads(header)
        first = _aligned(_START.size + length)
        if size != first + told["bytes"]:
            raise BodyError(f"{path}: {size} bytes, of {first + told['bytes']}")
        whole = mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ)
    if hasattr(mmap, "MADV_WILLNEED"):
        whole.madvise(mmap.MADV_WILLNEED)
    found: dict[str, Array] = {}
    for name, (kind, shape, order, offset, sums) in told["arrays"].items():
        count = prod(shape)
        array: Array = np.frombuffer(whole, np.dtype(kind), count, first + offset)
        if _sums(array.view(np.uint8)) != sums:
            raise BodyError(f"{path}: array {name!r} is damaged")
        array = array.reshape(shape, order=order)
        found[name] = array if mapped else array.copy(order="K")
    return found


def _write(file: IO[bytes], header: bytes, flat: list[Array]) -> None:
    file.write(_START.pack(_MAGIC, len(header), zlib.crc32(header), 0))
    file.write(header)
    file.write(bytes(_aligned(file.tell()) - file.tell()))
    for line in flat:
        file.write(line.view(np.uint8).data)
        file.write(bytes(_aligned(line.nbytes) - line.nbytes))


def _sums(data: npt.NDArray[np.uint8]) -> list[int]:
    """Of the 64-bit words of each piece, modulo 2^64; the last word is filled up with zeros."""
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
