"""Reads label maps in NIfTI files: the header through nibabel, then only the declared voxels.

The voxels are read here, since nibabel reads everything between the header and the voxels, and a
compressed file of a megabyte can put gigabytes there.
"""

from __future__ import annotations

import itertools
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from cohaptic.errors import BodyError
from cohaptic_server.numeric import Floats
from cohaptic_server.objects.memory_limit import say_once, silenced, unreadable
from cohaptic_server.objects.scan.label_map import (
    SAME_SPACING,
    LabelMap,
    check_size,
    spacings_differ,
)
from cohaptic_server.objects.scan.voxels import library, read_upto, read_voxels, unpacked

_HEADER = 544  # bytes of the longer header, with the four that say whether extensions follow
_MAX_BETWEEN = 2**20  # bytes between header and voxels; programs write some thousand there
_METRES = {"meter": 1.0, "mm": 1e-3, "micron": 1e-6, "unknown": 1e-3}


def read_nifti(path: Path) -> LabelMap:
    """Read a NIfTI file; x is to the right of the patient, y forwards, z up.

    Args:
        path: Path of a `.nii` or `.nii.gz`.

    Raises:
        BodyError: The file is not a label map that can be read.
    """
    nibabel = library("nibabel", "nibabel", f"{path}: reading NIfTI")
    try:
        with unpacked(path) as file:
            # nibabel logs every odd field; our own errors report the fields that matter.
            with silenced("nibabel"):
                header = _header(nibabel, bytes(read_upto(file, _HEADER)))
                described = _described(path, header)
                place, words = _placed(header, described.shape)
            for said in words:
                say_once(path, said)
            file.seek(_start(path, header))
            values = read_voxels(path, file, described.shape, described.kind)
    except BodyError:
        raise
    except MemoryError:
        raise
    except Exception as error:  # nibabel's readers raise errors of many kinds
        raise unreadable(path, "NIfTI", error) from error
    affine = described.unit * place
    return LabelMap.of(path, values, affine, {}, described.scaling)


class _Described(NamedTuple):
    """What a header says about its voxels.

    Args:
        shape: Number of voxels along each axis.
        kind: Type of one voxel.
        unit: Metres in the unit of the header.
        scaling: Factor, and what is then added, of the stored values.
    """

    shape: tuple[int, ...]
    kind: np.dtype[Any]
    unit: float
    scaling: tuple[float, float]


def _header(nibabel: Any, start: bytes) -> Any:
    """Header at the start of a file, in the first or the second version of NIfTI."""
    for kind in (nibabel.Nifti1Header, nibabel.Nifti2Header):
        if kind.may_contain_header(start):
            return kind(start[: kind.sizeof_hdr])
    raise ValueError("it does not begin as NIfTI does")


def _described(path: Path, header: Any) -> _Described:
    shape = tuple(int(n) for n in header.get_data_shape())
    while len(shape) > 3 and shape[-1] == 1:
        shape = shape[:-1]
    kind = np.dtype(header.get_data_dtype())
    if kind.kind not in "iuf":
        raise BodyError(f"{path}: its voxels are {kind}; a label map has whole numbers")
    check_size(path, shape, kind.itemsize)
    slope, shift = header.get_slope_inter()
    scaling = (1.0, 0.0) if slope is None else (float(slope), float(shift or 0.0))
    unit = _METRES.get(str(header.get_xyzt_units()[0]), 1e-3)
    return _Described(shape, kind, unit, scaling)


def _placed(header: Any, shape: tuple[int, ...]) -> tuple[Floats, list[str]]:
    """Map from voxel indices to places, shape (3, 4), and words where the header is not clear.

    A header may say the place twice, as the rows of a matrix (sform) and as a rotation (qform), and
    the spacing a third time. Programs differ in which they take; nibabel and most take the sform.
    """
    place = np.array(header.get_best_affine(), dtype=np.float64)[:3]
    spacing = np.array(header["pixdim"], dtype=np.float64)[1:4]
    if not int(header["sform_code"]):
        if int(header["qform_code"]):
            return place, []  # its spacing is that of the header
        return place, [
            "its header says no place of the voxels (no sform, no qform): their axes are taken for"
            " left, front and up. Left and right may be the wrong way round"
        ]
    words: list[str] = []
    if int(header["qform_code"]):
        try:
            other = np.array(header.get_qform(), dtype=np.float64)[:3]
        except Exception:  # nibabel's error for a quaternion that is no rotation
            other = np.full((3, 4), np.inf)
        corners = np.array(list(itertools.product(*([-0.5, n - 0.5] for n in shape))))
        away = corners @ (place - other)[:, :3].T + (place - other)[:, 3]
        apart = float(np.linalg.norm(away, axis=1).max())
        # Half a voxel is how well a segmentation places a surface.
        if not apart <= 0.5 * float(np.linalg.norm(place[:, :3], axis=0).min()):
            words.append(
                "its header says the place of the voxels twice, and differently (by up to"
                f" {apart:.3g} of its units): the sform is taken, not the qform"
            )
    sides = np.linalg.norm(place[:, :3], axis=0)
    if not (np.abs(sides - spacing) <= SAME_SPACING * sides).all():
        words.append(spacings_differ(spacing, sides, "the sform"))
    return place, words


def _start(path: Path, header: Any) -> int:
    """Offset of the voxels in the unpacked file [bytes]."""
    start, ends = int(header.get_data_offset()), int(header.sizeof_hdr)
    if bytes(header["magic"]).startswith(b"ni"):
        raise BodyError(f"{path}: its voxels are in another file; store both as one .nii")
    if not ends <= start <= ends + _MAX_BETWEEN:
        raise BodyError(
            f"{path}: its header says that its voxels begin at byte {start:,}; it has {ends:,}"
            f" itself, and at most {_MAX_BETWEEN:,} may follow before them"
        )
    return start
