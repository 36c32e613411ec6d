"""Surfaces of too many triangles: how many there are, at a glance, and fewer at the user's word."""

from __future__ import annotations

import json
import re
import struct
from pathlib import Path
from typing import Any

import numpy as np

from cohaptic.errors import BodyError
from cohaptic_server.numeric import Floats, Ints

_HEAD = 2**16  # bytes in which a header must end


def count_triangles(path: Path) -> int:
    """Triangles that a file says it has, or about so many; 0 where that cannot be told quickly.

    Reading millions takes a minute: what is too much can be refused before.
    """
    kind = path.suffix.lower()
    with path.open("rb") as file:
        head = file.read(_HEAD)
        if kind == ".stl" and len(head) >= 84:
            told = int.from_bytes(head[80:84], "little")
            if path.stat().st_size == 84 + 50 * told:
                return told
            return _lines(path, b"facet normal")
        if kind == ".ply":
            found = re.search(rb"element\s+face\s+(\d+)", head)
            return int(found[1]) if found else 0
        if kind == ".off":
            words = head.split(maxsplit=4)
            return (
                int(words[2]) if words[:1] == [b"OFF"] and words[2:3] and words[2].isdigit() else 0
            )
    if kind == ".obj":
        return _lines(path, b"\nf ")
    return _of_glb(head) if kind == ".glb" else 0


def _lines(path: Path, mark: bytes) -> int:
    count, rest = 0, b""
    with path.open("rb") as file:
        while block := file.read(2**24):
            whole = rest + block
            count += whole.count(mark)
            rest = whole[-len(mark) + 1 :]
    return count


def _of_glb(head: bytes) -> int:
    """Indices of all primitives over three, from the JSON at the start of a GLB."""
    try:
        (length,) = struct.unpack_from("<I", head, 12)
        told = json.loads(head[20 : 20 + length])
        counts = [accessor["count"] for accessor in told["accessors"]]
        primitives = [p for mesh in told["meshes"] for p in mesh["primitives"]]
        return sum(int(counts[p["indices"]]) for p in primitives if "indices" in p) // 3
    except (ValueError, KeyError, IndexError, TypeError, struct.error):
        return 0  # whoever reads the file will say what is wrong with it


def simplified(x: Floats, faces: Ints, count: int) -> tuple[Floats, Ints]:
    """The surface with about `count` triangles, by quadric errors (Garland, Heckbert 1997).

    Raises:
        BodyError: fast-simplification is not there.
    """
    try:
        import fast_simplification
    except ImportError as error:
        raise BodyError(
            "--simplify needs fast-simplification; install it with: pip install 'cohaptic[objects]'"
        ) from error
    # It works in single precision: about the middle, and of size one, no digit is wasted.
    low, size = x.min(axis=0), float(np.ptp(x, axis=0).max()) or 1.0
    simplify: Any = fast_simplification.simplify
    points, triangles = simplify(
        ((x - low) / size).astype(np.float32), faces.astype(np.int32), target_count=count
    )
    found = low + size * np.asarray(points, dtype=np.float64)
    return found, np.asarray(triangles, dtype=np.int64)
