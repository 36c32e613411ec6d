"""Reads label maps in NIfTI files: the header through nibabel, then only the declared voxels.

The voxels are read here, since nibabel reads everything between the header and the voxels, and a
compressed file of a megabyte can put gigabytes there.
"""

from __future__ import annotations

import gzip
import logging
from pathlib import Path
from typing import IO, Any, cast

import numpy as np

from cohaptic.errors import BodyError
from cohaptic_server.numeric import Floats
from cohaptic_server.objects.memory_limit import unreadable
from cohaptic_server.objects.scan.label_map import LabelMap, check_size
from cohaptic_server.objects.scan.voxels import library, read_upto, read_voxels

_HEADER = 544  # bytes of the longer header, with the four that say whether extensions follow
_MOST_BETWEEN = 2**20  # bytes between header and voxels; programs write some thousand there
_METRES = {"meter": 1.0, "mm": 1e-3, "micron": 1e-6, "unknown": 1e-3}


def read_nifti(path: Path) -> LabelMap:
    """Read a NIfTI file; x is to the right of the patient, y forwards, z up.

    Args:
        path: Path of a `.nii` or `.nii.gz`.

    Raises:
        BodyError: The file is not a label map that can be read.
    """
    nibabel = library("nibabel", "nibabel", f"{path}: reading NIfTI")
    # nibabel logs every odd field; our own errors report the fields that matter.
    log = logging.getLogger("nibabel.global")
    was_disabled, log.disabled = log.disabled, True
    try:
        with _unpacked(path) as file:
            header = _header(nibabel, bytes(read_upto(file, _HEADER)))
            shape, kind, affine = _described(path, header)
            file.seek(_start(path, header))
            values = read_voxels(path, file, shape, kind)
    except BodyError:
        raise
    except MemoryError:
        raise
    except Exception as error:  # nibabel's readers raise errors of many kinds
        raise unreadable(path, "NIfTI", error) from error
    finally:
        log.disabled = was_disabled
    return LabelMap.of(path, values, affine, {})


def _unpacked(path: Path) -> IO[bytes]:
    return cast("IO[bytes]", gzip.open(path)) if path.suffix.lower() == ".gz" else path.open("rb")


def _header(nibabel: Any, start: bytes) -> Any:
    """Header at the start of a file, in the first or the second version of NIfTI."""
    for kind in (nibabel.Nifti1Header, nibabel.Nifti2Header):
        if kind.may_contain_header(start):
            return kind(start[: kind.sizeof_hdr])
    raise ValueError("it does not begin as NIfTI does")


def _described(path: Path, header: Any) -> tuple[tuple[int, ...], np.dtype[Any], Floats]:
    """Shape and type of the voxels, and the map from their indices to metres, shape (3, 4)."""
    shape = tuple(int(n) for n in header.get_data_shape())
    while len(shape) > 3 and shape[-1] == 1:
        shape = shape[:-1]
    kind = np.dtype(header.get_data_dtype())
    if kind.kind not in "iuf":
        raise BodyError(f"{path}: its voxels are {kind}; a label map has whole numbers")
    check_size(path, shape, kind.itemsize)
    slope, shift = header.get_slope_inter()
    if slope is not None and (slope, shift) != (1.0, 0.0):
        raise BodyError(
            f"{path}: its values are scaled by {slope:g} and shifted by {shift:g}; a label map"
            " has whole numbers as they are"
        )
    unit = _METRES.get(str(header.get_xyzt_units()[0]), 1e-3)
    return shape, kind, unit * np.array(header.get_best_affine(), dtype=np.float64)[:3]


def _start(path: Path, header: Any) -> int:
    """Offset of the voxels in the unpacked file [bytes]."""
    start, ends = int(header.get_data_offset()), int(header.sizeof_hdr)
    if bytes(header["magic"]).startswith(b"ni"):
        raise BodyError(f"{path}: its voxels are in another file; store both as one .nii")
    if not ends <= start <= ends + _MOST_BETWEEN:
        raise BodyError(
            f"{path}: its header says that its voxels begin at byte {start:,}; it has {ends:,}"
            f" itself, and at most {_MOST_BETWEEN:,} may follow before them"
        )
    return start
