"""Counts the triangles of a file without parsing all of it, and simplifies a surface."""

from __future__ import annotations

import json
import math
import re
import struct
from pathlib import Path
from typing import Any

import numpy as np

from cohaptic.errors import BodyError
from cohaptic_server.numeric import Floats, Ints
from cohaptic_server.objects.surface.checks import examine
from cohaptic_server.objects.surface.three_mf import look_into

_HEAD = 2**16  # bytes that are read for the header of a file
_HASTE = (7, 5, 4, 3)  # speeds to try in turn, `agg` of fast-simplification; 7 is its default
_TOO_MANY = 1.2  # triangles of a failed result over the wanted number


def count_triangles(path: Path) -> int:
    """Approximate number of triangles in a file; 0 if it cannot be determined quickly.

    Reading millions of triangles takes a minute; this number lets us refuse a file that is too
    large before we read it.

    Args:
        path: A surface file that exists.
    """
    kind = path.suffix.lower()
    if kind == ".3mf":
        try:
            return look_into(path).triangles
        except BodyError:
            return 0  # the reader of the file reports the error
    with path.open("rb") as file:
        head = file.read(_HEAD)
        if kind == ".stl" and len(head) >= 84:
            declared = int.from_bytes(head[80:84], "little")
            if path.stat().st_size == 84 + 50 * declared:
                return declared
            return _count_marks(path, b"facet normal")
        if kind == ".ply":
            match = re.search(rb"element\s+face\s+(\d{1,18})\b", head)
            return int(match[1]) if match else 0
        if kind == ".off":
            match = re.match(rb"OFF\s+\d+\s+(\d{1,18})\b", head)
            return int(match[1]) if match else 0
    if kind == ".obj":
        return _count_marks(path, b"\nf ")
    return _count_in_glb(head) if kind == ".glb" else 0


def _count_marks(path: Path, mark: bytes) -> int:
    """Number of times that a text occurs in a file."""
    count, rest = 0, b""
    with path.open("rb") as file:
        while block := file.read(2**24):
            whole = rest + block
            count += whole.count(mark)
            rest = whole[-len(mark) + 1 :]
    return count


def _count_in_glb(head: bytes) -> int:
    """Triangles of all indexed primitives, from the JSON at the start of a GLB; 0 if unreadable."""
    try:
        (length,) = struct.unpack_from("<I", head, 12)
        header = json.loads(head[20 : 20 + length])
        counts = [accessor["count"] for accessor in header["accessors"]]
        primitives = [p for mesh in header["meshes"] for p in mesh["primitives"]]
        return sum(int(counts[p["indices"]]) for p in primitives if "indices" in p) // 3
    except (ValueError, LookupError, TypeError, AttributeError, ArithmeticError, RecursionError,
            struct.error):  # fmt: skip
        return 0  # the reader of the file reports the error


def simplify(x: Floats, faces: Ints, count: int) -> tuple[Floats, Ints]:
    """Simplify a surface by quadric error metrics (Garland, Heckbert 1997).

    A fast run may fold a clean surface onto itself, with up to 23 crossing triangles of 4,000. Each
    result is therefore examined, and if it has defects a slower run is tried. The result with the
    fewest defects is returned.

    Args:
        x: Vertices, shape (n, 3).
        faces: Triangles, shape (m, 3).
        count: Number of triangles to reach, approximately.

    Raises:
        BodyError: fast-simplification is not installed.
    """
    best, least = (x, faces), math.inf
    for haste in _HASTE:
        found = _collapsed(x, faces, count, haste)
        if len(found[1]) > _TOO_MANY * count and math.isfinite(least):
            break  # a slower run stops even farther from the wanted number
        report = examine(*found)
        defects = report.open_edges + report.nonmanifold_edges + report.intersecting
        if defects < least:
            best, least = found, defects
        if not defects:
            break
    return best


def _collapsed(x: Floats, faces: Ints, count: int, haste: int) -> tuple[Floats, Ints]:
    try:
        import fast_simplification
    except ImportError as error:
        raise BodyError(
            "--simplify needs fast-simplification; install it with: pip install 'cohaptic[objects]'"
        ) from error
    # fast-simplification works in single precision: coordinates from 0 to 1 lose fewest digits.
    low, size = x.min(axis=0), float(np.ptp(x, axis=0).max()) or 1.0
    collapse_edges: Any = fast_simplification.simplify
    points, triangles = collapse_edges(
        ((x - low) / size).astype(np.float32),
        faces.astype(np.int32),
        target_count=count,
        agg=haste,
    )
    simplified = low + size * np.asarray(points, dtype=np.float64)
    return simplified, np.asarray(triangles, dtype=np.int64)
