"""Reads label maps in NRRD files: the header through pynrrd, then only the declared voxels.

The voxels are read here, since pynrrd unpacks compressed voxels without a limit of their size, and
reads other files that a header names.
"""

from __future__ import annotations

import gzip
import io
import re
from collections.abc import Mapping
from pathlib import Path
from typing import IO, Any, cast

import numpy as np

from cohaptic.errors import BodyError, one_line
from cohaptic_server.numeric import Floats
from cohaptic_server.objects.memory_limit import unreadable
from cohaptic_server.objects.parts.parts import MAX_NAME
from cohaptic_server.objects.scan.label_map import LabelMap, check_size
from cohaptic_server.objects.scan.voxels import library, read_voxels

_HEAD = 2**20  # most bytes of a header; headers of segmentations have a few thousand
_METRES = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6}
# Signs of x and y that make x point right and y forwards, as in NIfTI.
_SPACES = {
    "left-posterior-superior": (-1.0, -1.0),
    "lps": (-1.0, -1.0),
    "left-anterior-superior": (-1.0, 1.0),
    "las": (-1.0, 1.0),
}
_KINDS = {
    "int8": "i1", "signed char": "i1", "uint8": "u1", "uchar": "u1", "unsigned char": "u1",
    "int16": "i2", "short": "i2", "uint16": "u2", "ushort": "u2", "unsigned short": "u2",
    "int32": "i4", "int": "i4", "uint32": "u4", "uint": "u4", "unsigned int": "u4",
    "int64": "i8", "longlong": "i8", "uint64": "u8", "ulonglong": "u8",
    "float": "f4", "double": "f8",
}  # fmt: skip


def read_nrrd(path: Path) -> LabelMap:
    """Read an NRRD file that contains its voxels; the axes are those of `read_nifti`.

    Args:
        path: Path of a `.nrrd`.

    Raises:
        BodyError: The file is not a label map that can be read.
    """
    parse = library("nrrd", "pynrrd", f"{path}: reading NRRD").read_header
    with path.open("rb") as file:
        head = file.read(_HEAD)
        end = re.search(rb"\r?\n\r?\n", head)
        if end is None:
            raise BodyError(f"{path}: no header of an NRRD ends in its first {_HEAD:,} bytes")
        try:
            parsed: Any = parse(io.BytesIO(head[: end.end()]))
            header: dict[str, Any] = {str(key).lower(): parsed[key] for key in parsed}
            shape, kind, affine = _described(path, header)
            file.seek(end.end())
            packing = str(header["encoding"]).lower()
            values = read_voxels(path, _unpacked(path, file, packing), shape, kind)
            names = _names(header)
        except BodyError:
            raise
        except MemoryError:
            raise
        except Exception as error:  # pynrrd's parsers raise errors of many kinds
            raise unreadable(path, "NRRD", error) from error
    return LabelMap.of(path, values, affine, names)


def _described(
    path: Path, header: Mapping[str, Any]
) -> tuple[tuple[int, ...], np.dtype[Any], Floats]:
    """Shape and type of the voxels, and the map from their indices to metres, shape (3, 4)."""
    if "data file" in header or "datafile" in header:
        raise BodyError(f"{path}: its voxels are in another file; store both as one .nrrd")
    if any(int(header.get(key, 0)) for key in ("byte skip", "byteskip", "line skip", "lineskip")):
        raise BodyError(f"{path}: it skips bytes before its voxels, which is not read")
    sizes = tuple(int(n) for n in np.asarray(header["sizes"]).reshape(-1))
    name = str(header["type"]).lower().removesuffix("_t")
    if name not in _KINDS:
        raise BodyError(f"{path}: its voxels are {name[:20]!r}; a label map has whole numbers")
    order = ">" if str(header.get("endian", "little")).lower() == "big" else "<"
    kind = np.dtype(order + _KINDS[name])
    vectors = header.get("space directions")
    if vectors is None:
        spacings = np.asarray(header.get("spacings", np.ones(len(sizes))), dtype=np.float64)
        vectors = np.diag(spacings.reshape(-1))
    rows = [np.asarray(row, dtype=np.float64).reshape(-1) for row in vectors]
    # An axis without a direction lists layers of overlapping segments. With only one layer that
    # axis is dropped.
    spatial = [len(row) == 3 and bool(np.isfinite(row).all()) for row in rows]
    if len(rows) == len(sizes):
        sizes = tuple(n for n, kept in zip(sizes, spatial, strict=True) if kept or n != 1)
        rows = [row for row, kept in zip(rows, spatial, strict=True) if kept]
    check_size(path, sizes, kind.itemsize)
    origin = np.asarray(header.get("space origin", np.zeros(3)), dtype=np.float64).reshape(-1)
    affine = np.column_stack([*rows, origin])
    if affine.shape != (3, 4):
        raise BodyError(f"{path}: its header says no place of the voxels in space")
    across, forwards = _SPACES.get(str(header.get("space", "")).lower(), (1.0, 1.0))
    signs = np.array([across, forwards, 1.0])
    units = header.get("space units")
    unit = _METRES.get(str(units[0]).strip('"').lower(), 1e-3) if units is not None else 1e-3
    return sizes, kind, unit * signs[:, None] * affine


def _unpacked(path: Path, file: IO[bytes], encoding: str) -> IO[bytes]:
    """Rest of the file, uncompressed; raises BodyError for encodings other than raw and gzip."""
    if encoding == "raw":
        return file
    if encoding in ("gzip", "gz"):
        return cast("IO[bytes]", gzip.GzipFile(fileobj=file))
    raise BodyError(f"{path}: its voxels are stored as {encoding[:20]!r}; raw and gzip are read")


def _names(header: Mapping[str, Any]) -> dict[int, str]:
    """Names of the segments that 3D Slicer writes, by label value."""
    found: dict[int, str] = {}
    for key, value in header.items():
        match = re.fullmatch(r"segment(\d+)_labelvalue", key)
        if match is not None and f"segment{match[1]}_name" in header:
            found[int(value)] = one_line(str(header[f"segment{match[1]}_name"]), MAX_NAME)
    return found
