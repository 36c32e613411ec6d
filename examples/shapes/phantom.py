"""A label map of an organ with a vessel and a tumour in it, as a NIfTI file."""

from __future__ import annotations

import gzip
import struct
from typing import Any

import numpy as np
import numpy.typing as npt

from cohaptic_server.numeric import Floats

ORGAN, VESSEL, TUMOUR = 1, 2, 3  # labels
_SPACING = (1.5, 1.5, 3.0)  # mm
_SIZE = (100, 76, 30)  # voxels
_HEADER = 348  # bytes


def labels() -> npt.NDArray[np.uint8]:
    """An organ of two lobes, 130 x 90 x 70 mm; a vessel of 14 mm that enters it; a tumour of 24 mm.

    Beside it there are three specks, as segmentations have them.
    """
    i, j, k = np.indices(_SIZE)
    x, y, z = (s * (n - 0.5 * (m - 1)) for n, m, s in zip((i, j, k), _SIZE, _SPACING, strict=True))
    organ = _ball(x, y, z, (-18.0, 0.0, 0.0), (48.0, 45.0, 36.0))
    organ |= _ball(x, y, z, (30.0, 4.0, -4.0), (36.0, 30.0, 26.0))
    # The vessel comes in from behind and turns to the right lobe.
    vessel = (np.hypot(x + 10.0, z - 2.0) < 7.0) & (y > -5.0)
    vessel |= (np.hypot(y + 2.0 - 0.1 * x, z - 2.0) < 6.0) & (x > -12.0) & (x < 35.0)
    tumour = _ball(x, y, z, (-38.0, -16.0, 14.0), (12.0, 12.0, 12.0))
    found = np.where(organ, ORGAN, 0).astype(np.uint8)
    found[organ & vessel] = VESSEL
    found[organ & tumour & ~vessel] = TUMOUR
    found[3:5, 4, 5] = found[90, 70, 20:22] = found[50, 2, 3] = ORGAN
    return found


def _ball(
    x: Floats,
    y: Floats,
    z: Floats,
    middle: tuple[float, float, float],
    radii: tuple[float, float, float],
) -> npt.NDArray[np.bool_]:
    off = zip((x, y, z), middle, radii, strict=True)
    return np.asarray(sum(((a - b) / r) ** 2 for a, b, r in off) < 1.0)


def nifti(
    values: npt.NDArray[Any], spacing: tuple[float, float, float] = _SPACING, code: int = 2
) -> bytes:
    """The bytes of a NIfTI-1 file of unsigned bytes, about the origin.

    Args:
        values: Values of the voxels, shape (i, j, k).
        spacing: Between voxels [mm].
        code: Code of the type of the voxels: 2 for unsigned bytes.
    """
    start = [-0.5 * s * (n - 1) for n, s in zip(values.shape, spacing, strict=True)]
    rows = [[s if a == b else 0.0 for b in range(3)] + [start[a]] for a, s in enumerate(spacing)]
    head = bytearray(_HEADER + 4)
    struct.pack_into("<i", head, 0, _HEADER)
    struct.pack_into("<8h", head, 40, 3, *values.shape, 1, 1, 1, 1)
    struct.pack_into("<2h", head, 70, code, 8 * values.dtype.itemsize)
    struct.pack_into("<8f", head, 76, 1.0, *spacing, 0.0, 0.0, 0.0, 0.0)
    struct.pack_into("<3f", head, 108, _HEADER + 4.0, 1.0, 0.0)
    head[123] = 2  # millimetres
    struct.pack_into("<2h", head, 252, 0, 1)  # only the rows that follow say where voxels are
    for row, offset in zip(rows, (280, 296, 312), strict=True):
        struct.pack_into("<4f", head, offset, *row)
    head[344:348] = b"n+1\0"
    return bytes(head) + values.tobytes(order="F")


def phantom() -> bytes:
    """The label map, compressed."""
    return gzip.compress(nifti(labels()), mtime=0)
