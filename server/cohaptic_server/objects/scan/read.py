"""Recognises files that are label maps, and reads them."""

from __future__ import annotations

import zlib
from pathlib import Path

import numpy as np

from cohaptic.errors import BodyError
from cohaptic_server.objects.first_bytes import START, check_start
from cohaptic_server.objects.memory_limit import unreadable
from cohaptic_server.objects.scan.label_map import LabelMap
from cohaptic_server.objects.scan.nifti import read_nifti
from cohaptic_server.objects.scan.nrrd_file import read_nrrd
from cohaptic_server.objects.scan.voxels import read_upto, unpacked
from cohaptic_server.touchable import SCANS, kind_of


def is_scan(path: Path) -> bool:
    """Whether the name of a file is that of a label map."""
    return kind_of(path.name) in SCANS


def read_scan(path: Path) -> LabelMap:
    """Read the label map in a file.

    Raises:
        BodyError: The file is not a label map that can be read, or takes too much memory.
    """
    try:
        with unpacked(path) as file:
            start = bytes(read_upto(file, START))
        if not start and path.stat().st_size:
            raise OSError("nothing can be unpacked from it")
    except (OSError, zlib.error) as error:
        raise unreadable(path, "label map", error) from error
    check_start(path, start)
    # The name may be that of the other format.
    is_nrrd = start.startswith(b"NRRD")
    # Numbers of a damaged header are beyond their types; what they mean is checked in words.
    with np.errstate(all="ignore"):
        try:
            return read_nrrd(path) if is_nrrd else read_nifti(path)
        except MemoryError as error:
            raise BodyError(
                f"{path}: its voxels take more memory than this process may have. Crop it to the"
                " organ, or resample it"
            ) from error
