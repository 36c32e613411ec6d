"""Reads label maps in NRRD files: the header through pynrrd, then only the declared voxels.

The voxels are read here, since pynrrd unpacks compressed voxels without a limit of their size, and
reads other files that a header names.
"""

from __future__ import annotations

import gzip
import io
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import IO, Any, NamedTuple, cast

import numpy as np

from cohaptic.errors import BodyError, one_line
from cohaptic_server.numeric import Floats
from cohaptic_server.objects.memory_limit import say_once, silenced, unreadable
from cohaptic_server.objects.scan.label_map import (
    SAME_SPACING,
    LabelMap,
    check_size,
    spacings_differ,
)
from cohaptic_server.objects.scan.segments import joined, segments_of
from cohaptic_server.objects.scan.voxels import library, read_upto, read_voxels, unpacked

_HEAD = 2**20  # most bytes of a header; headers of segmentations have a few thousand
_METRES = {
    "m": 1.0, "meter": 1.0, "meters": 1.0, "cm": 1e-2, "mm": 1e-3, "millimeter": 1e-3,
    "millimeters": 1e-3, "um": 1e-6, "micron": 1e-6, "microns": 1e-6,
}  # fmt: skip
# Signs of x and y that make x point right and y forwards, as in NIfTI.
_SPACES = {
    "left-posterior-superior": (-1.0, -1.0),
    "lps": (-1.0, -1.0),
    "left-anterior-superior": (-1.0, 1.0),
    "las": (-1.0, 1.0),
    "right-anterior-superior": (1.0, 1.0),
    "ras": (1.0, 1.0),
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
    try:
        with unpacked(path) as file:
            head = bytes(read_upto(file, _HEAD))
            end = re.search(rb"\r?\n\r?\n", head)
            if end is None:
                raise BodyError(f"{path}: no header of an NRRD ends in its first {_HEAD:,} bytes")
            with silenced("nrrd"):
                parsed: Any = parse(io.BytesIO(head[: end.end()]))
            header: dict[str, Any] = {str(key).lower(): parsed[key] for key in parsed}
            stored = _stored(path, header)
            affine, words = _placed(path, header, stored.spatial)
            file.seek(end.end())
            packing = str(header["encoding"]).lower()
            data = _unpacked(path, file, packing)
            values = read_voxels(path, data, stored.shape, stored.kind)
            segments = segments_of(header)
    except BodyError:
        raise
    except MemoryError:
        raise
    except Exception as error:  # pynrrd's parsers raise errors of many kinds
        raise unreadable(path, "NRRD", error) from error
    for said in words:
        say_once(path, said)
    if stored.layers is not None:
        layers = np.moveaxis(values, stored.layers, 0)
        values, names = joined(path, layers, segments)
    else:
        names = {one.value: one.name for one in segments if one.name}
    return LabelMap.of(path, values, affine, names)


class _Stored(NamedTuple):
    """What a header says about its voxels.

    Args:
        shape: Number of voxels along each axis, without axes of one voxel that are not in space.
        kind: Type of one voxel.
        spatial: Whether each axis of the header is one in space.
        layers: Axis of `shape` that lists layers of segments; None if there is none.
    """

    shape: tuple[int, ...]
    kind: np.dtype[Any]
    spatial: tuple[bool, ...]
    layers: int | None


def _stored(path: Path, header: Mapping[str, Any]) -> _Stored:
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
    # An axis without a direction lists layers of overlapping segments. With only one layer that
    # axis is dropped.
    spatial = tuple(bool(np.isfinite(row).all()) for row in _vectors(header, len(sizes)))
    if len(spatial) != len(sizes):
        raise BodyError(f"{path}: it has {len(sizes)} axes, and says directions of {len(spatial)}")
    kept = [k for k, n in enumerate(sizes) if spatial[k] or n != 1]
    lists = [at for at, k in enumerate(kept) if not spatial[k]]
    shape = tuple(sizes[k] for k in kept)
    kinds = [str(one).lower() for one in header.get("kinds", ())]
    layers = lists[0] if len(lists) == 1 and len(shape) == 4 else None
    if layers is not None and len(kinds) == len(sizes) and kinds[kept[layers]] != "list":
        layers = None  # a vector or a colour of each voxel
    if layers is None:
        check_size(path, shape, kind.itemsize)
    else:
        space = tuple(n for at, n in enumerate(shape) if at != layers)
        check_size(path, space, kind.itemsize * max(1, shape[layers]))
    return _Stored(shape, kind, spatial, layers)


def _vectors(header: Mapping[str, Any], axes: int) -> list[Floats]:
    """Direction of each axis, with its spacing as its length; not finite if it has none."""
    vectors = header.get("space directions")
    if vectors is None:
        vectors = np.diag(np.asarray(header.get("spacings", np.ones(axes)), dtype=np.float64))
    rows = [np.asarray(row, dtype=np.float64).reshape(-1) for row in vectors]
    return [row if len(row) == 3 else np.full(3, np.nan) for row in rows]


def _placed(
    path: Path, header: Mapping[str, Any], spatial: Sequence[bool]
) -> tuple[Floats, list[str]]:
    """Map from voxel indices to metres, shape (3, 4), and words where the header is not clear."""
    rows = [row for row, kept in zip(_vectors(header, len(spatial)), spatial, strict=True) if kept]
    origin = np.asarray(header.get("space origin", np.zeros(3)), dtype=np.float64).reshape(-1)
    affine = np.column_stack([*rows, origin])
    if affine.shape != (3, 4):
        raise BodyError(f"{path}: its header says no place of the voxels in space")
    words: list[str] = []
    sides = np.linalg.norm(affine[:, :3], axis=0)
    spacings = header.get("spacings")
    if "space directions" not in header:
        words += [] if spacings is not None else ["its header says no spacing: 1 mm is taken"]
    elif spacings is not None:
        said = np.asarray(spacings, dtype=np.float64).reshape(-1)
        said = said[list(spatial)] if len(said) == len(spatial) else np.full(3, np.nan)
        if not (np.abs(said - sides) <= SAME_SPACING * sides).all():
            words.append(spacings_differ(said, sides, "the directions"))
    space = one_line(str(header.get("space", "")), 40)
    known = space.lower().removesuffix("-time")
    known = known[:3] if known in ("rast", "last", "lpst") else known
    if known not in _SPACES:
        where = f"its header says the space {space!r}, which" if space else "its header"
        words.append(
            f"{where} does not say where left and right are: x is taken for right, y for front and"
            " z for up (RAS). Left and right may be the wrong way round"
        )
    across, forwards = _SPACES.get(known, (1.0, 1.0))
    signs = np.array([across, forwards, 1.0])
    return _unit(path, header, spatial, words) * signs[:, None] * affine, words


def _unit(
    path: Path, header: Mapping[str, Any], spatial: Sequence[bool], words: list[str]
) -> float:
    """Metres in the unit of a header; millimetres if it says none."""
    said = [str(one).strip('"').lower() for one in header.get("space units", ())]
    if not said:
        listed = [str(one).strip('"').lower() for one in header.get("units", ())]
        said = [one for one, kept in zip(listed, spatial, strict=False) if kept and one]
    if len(set(said)) > 1:
        raise BodyError(f"{path}: its axes have different units: {one_line(', '.join(said), 60)}")
    if said and said[0] and said[0] not in _METRES:
        words.append(f"its unit {one_line(said[0], 20)!r} is not known: millimetres are taken")
    return _METRES.get(said[0], 1e-3) if said else 1e-3


def _unpacked(path: Path, file: IO[bytes], encoding: str) -> IO[bytes]:
    """Rest of the file, uncompressed; raises BodyError for encodings other than raw and gzip."""
    if encoding == "raw":
        return file
    if encoding in ("gzip", "gz"):
        return cast("IO[bytes]", gzip.GzipFile(fileobj=file, mode="rb"))
    raise BodyError(f"{path}: its voxels are stored as {encoding[:20]!r}; raw and gzip are read")
