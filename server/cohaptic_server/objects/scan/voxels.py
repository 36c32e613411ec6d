"""Reads the voxels of a label map: as many bytes as its header says, and no more.

A compressed file of a megabyte can unpack to gigabytes. What is read here has passed `check_size`
before; whatever follows it in the file is left where it is.
"""

from __future__ import annotations

from pathlib import Path
from typing import IO, Any

import numpy as np
import numpy.typing as npt

from cohaptic.errors import BodyError

_BLOCK = 2**20  # bytes that are read at once


def read_voxels(
    path: Path, file: IO[bytes], shape: tuple[int, ...], kind: np.dtype[Any]
) -> npt.NDArray[Any]:
    """Read voxels, the first index fastest.

    Args:
        path: The file, for an error.
        file: Whose next byte is the first of the voxels, unpacked.
        shape: Shape of the voxels, as `check_size` has let pass.
        kind: Kind of one voxel.

    Returns:
        The voxels, of that shape.

    Raises:
        BodyError: There are fewer.
    """
    expected = int(np.prod(shape, dtype=np.int64)) * kind.itemsize
    data = read_upto(file, expected)
    if len(data) < expected:
        raise BodyError(
            f"{path}: its header says {expected:,} bytes of voxels and it has {len(data):,}"
        )
    return np.frombuffer(data, kind).reshape(shape, order="F")


def read_upto(file: IO[bytes], most: int) -> bytearray:
    """The next bytes of a file, up to so many; block by block, since a file may promise more.

    Args:
        file: It may be compressed, and end before its compression does.
        most: Number of bytes.
    """
    data = bytearray()
    try:
        while len(data) < most and (block := file.read(min(_BLOCK, most - len(data)))):
            data += block
    except EOFError:  # of a compressed file that was cut off
        pass
    return data
