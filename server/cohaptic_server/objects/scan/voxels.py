"""Basis of the readers of label maps: the libraries of the extra `scans`, and bounded reading.

A library that is missing is named in an error.

A scan is packed by gzip if its first bytes say so: browsers unpack files and keep their names.

A reader takes as many bytes of voxels as the header declares, and no more: a compressed file of a
megabyte can unpack to gigabytes. The declared size has passed `check_size` before; the rest of the
file is not read.
"""

from __future__ import annotations

import contextlib
import gzip
import importlib
from collections.abc import Generator
from pathlib import Path
from typing import IO, Any, cast

import numpy as np
import numpy.typing as npt

from cohaptic.errors import BodyError
from cohaptic_server.objects.first_bytes import GZIP


def library(module: str, package: str, what: str) -> Any:
    """Import a module of a package that may be missing.

    Args:
        package: Name of the package to install.
        what: Purpose of the module, as the start of a sentence.

    Raises:
        BodyError: The package is not installed.
    """
    try:
        return importlib.import_module(module)
    except ImportError as error:
        raise BodyError(
            f"{what} needs {package}; install it with: pip install 'cohaptic[scans]'"
        ) from error


_BLOCK = 2**20  # bytes that are read at once


_LAYERS = 2  # times that a file may be packed by gzip: a server may pack a packed file again


@contextlib.contextmanager
def unpacked(path: Path) -> Generator[IO[bytes]]:
    """Open a file, as its bytes without gzip."""
    with contextlib.ExitStack() as files:
        file: IO[bytes] = files.enter_context(path.open("rb"))
        for _ in range(_LAYERS):
            start = read_upto(file, len(GZIP))
            file.seek(0)
            if bytes(start) != GZIP:
                break
            file = cast("IO[bytes]", files.enter_context(gzip.GzipFile(fileobj=file, mode="rb")))
        yield file


def read_voxels(
    path: Path, file: IO[bytes], shape: tuple[int, ...], kind: np.dtype[Any]
) -> npt.NDArray[Any]:
    """Read voxels whose first index varies fastest; an array of the given shape.

    Args:
        path: The file, for an error.
        file: Unpacked file, open at the first byte of the voxels.
        shape: Shape of the voxels that has passed `check_size`.
        kind: Type of one voxel.

    Raises:
        BodyError: The file has fewer voxels.
    """
    expected = int(np.prod(shape, dtype=np.int64)) * kind.itemsize
    data = read_upto(file, expected)
    if len(data) < expected:
        raise BodyError(
            f"{path}: its header says {expected:,} bytes of voxels and it has {len(data):,}"
        )
    return np.frombuffer(data, kind).reshape(shape, order="F")


def read_upto(file: IO[bytes], limit: int) -> bytearray:
    """Read up to `limit` bytes, block by block, since a file may have fewer than it declares.

    Args:
        file: File that may be compressed, and cut off within its compressed data.
        limit: Largest number of bytes.
    """
    data = bytearray()
    try:
        while len(data) < limit and (block := file.read(min(_BLOCK, limit - len(data)))):
            data += block
    except EOFError:  # raised for a compressed file that was cut off
        pass
    return data
