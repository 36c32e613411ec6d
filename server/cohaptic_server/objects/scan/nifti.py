"""Reads label maps of NIfTI files, through nibabel."""

from __future__ import annotations

import logging
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from cohaptic.errors import BodyError, one_line
from cohaptic_server.objects.scan.label_map import LabelMap, check_size
from cohaptic_server.objects.scan.library import library

_METRES = {"meter": 1.0, "mm": 1e-3, "micron": 1e-6, "unknown": 1e-3}


def read_nifti(path: Path) -> LabelMap:
    """Read a NIfTI file; x is to the right of the patient, y forwards, z up.

    Args:
        path: Of a `.nii` or `.nii.gz`.

    Raises:
        BodyError: It is no label map.
    """
    nibabel = library("nibabel", "nibabel", f"{path}: reading NIfTI")
    # It tells of every odd field; what matters of them is said here.
    log = logging.getLogger("nibabel.global")
    was_disabled, log.disabled = log.disabled, True
    try:
        image: Any = nibabel.load(path)
        shape = tuple(int(n) for n in image.shape)
        while len(shape) > 3 and shape[-1] == 1:
            shape = shape[:-1]
        kind = np.dtype(image.get_data_dtype())
        if kind.kind not in "iuf":
            raise BodyError(f"{path}: its voxels are {kind}; a label map has whole numbers")
        check_size(path, shape, kind.itemsize)
        slope, shift = image.dataobj.slope, image.dataobj.inter
        if (slope, shift) != (1.0, 0.0):
            raise BodyError(
                f"{path}: its values are scaled by {slope:g} and shifted by {shift:g}; a label map"
                " has whole numbers as they are"
            )
        unit = _METRES.get(str(image.header.get_xyzt_units()[0]), 1e-3)
        affine = unit * np.array(image.affine, dtype=np.float64)[:3]
        values: npt.NDArray[Any] = np.asanyarray(image.dataobj.get_unscaled()).reshape(
            shape, order="F"
        )
    except BodyError:
        raise
    except MemoryError:
        raise
    except Exception as error:  # nibabel's readers raise errors of many kinds
        words = one_line(f"{type(error).__name__}: {error}")
        raise BodyError(f"{path}: this is no NIfTI that can be read ({words})") from error
    finally:
        log.disabled = was_disabled
    return LabelMap.of(path, values, affine, {})
