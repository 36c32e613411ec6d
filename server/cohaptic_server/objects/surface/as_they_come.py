"""Brings the bytes of STL, OBJ, PLY and OFF files into the form that their readers expect.

Programs write these files with bytes behind the end, counts that are wrong, old line ends, a byte
order mark, UTF-16, capital keywords and decimal commas. Readers then fail, or return an empty mesh.
"""

from __future__ import annotations

import itertools
import re
import struct
from pathlib import Path

import numpy as np

from cohaptic.errors import BodyError
from cohaptic_server.numeric import Mask
from cohaptic_server.objects.first_bytes import START
from cohaptic_server.objects.memory_limit import say_once

_HEADER, _TRIANGLE = 84, 50  # bytes of a binary STL before its triangles, and of each
_LARGEST = 0.5  # least share of records that are triangles, in a file whose count is wrong
_LINES = 100  # lines of numbers that show whether decimal commas are used
# Two marks, then the codec; without a mark UTF-16 shows by the zeros between its letters.
_MARKS = ((b"\xff\xfe", "utf-16"), (b"\xfe\xff", "utf-16"), (b"\xef\xbb\xbf", "utf-8-sig"))
# A line of coordinates, after its keyword in STL and OBJ files. No two parts of the expressions
# take the same letters, so that a line of a megabyte is read in one pass.
_NUMBER = rb"[-+]?(?:\d+(?:[.,]\d*)?|[.,]\d+)(?:[eE][-+]?\d+)?"
# A line with three numbers or more, and the word before them in STL and OBJ files.
_POINTS = re.compile(
    rb"^[ \t]*(?:(?:vertex|vn|vt|v)[ \t]+)?(" + _NUMBER + rb"(?:[ \t]+" + _NUMBER + rb")+)[ \t]*$",
    re.M,
)
_COMMA = re.compile(rb"(?<=\d),(?=\d)")


def cleaned(path: Path) -> bytes:
    """Read a file, in the form in which its reader expects it.

    Args:
        path: A file of one of the kinds .stl, .obj, .ply and .off.

    Raises:
        BodyError: The file is a binary STL that cannot be brought into its form.
    """
    data = path.read_bytes()
    kind = path.suffix.lower()
    if kind == ".stl" and not _is_text_stl(data):
        return _binary_stl(path, data)
    if kind == ".ply" and re.search(rb"^\s*format\s+binary", data[:START], re.M):
        return data
    if kind == ".off" and re.match(rb"\s*\S*OFF\s+BINARY", data[:START]):
        return data
    return _text(data, lower=kind == ".stl")


def _is_text_stl(data: bytes) -> bool:
    """Whether an STL file is text; a binary one may begin with `solid`, too."""
    if len(data) >= _HEADER and len(data) == _HEADER + _TRIANGLE * _declared(data):
        return False
    start = _decoded(data[:START]).lstrip().lower()
    return b"\0" not in start and (start.startswith(b"solid") or b"facet" in start)


def _declared(data: bytes, start: int = 0) -> int:
    return int(struct.unpack_from("<I", data, start + 80)[0])


def _binary_stl(path: Path, data: bytes) -> bytes:
    """A binary STL file whose count and length agree."""
    there = (len(data) - _HEADER) // _TRIANGLE
    if there < 1:
        return data
    said = _declared(data)
    end = _HEADER + _TRIANGLE * said
    if len(data) >= end + _HEADER and _declared(data, end) == (
        (len(data) - end - _HEADER) / _TRIANGLE
    ):
        raise BodyError(f"{path}: it has several STL files, one after another. Give each alone")
    # Bytes behind the last triangle are common; triangles behind it are not to be lost.
    if not 0 < said <= there or _are_triangles(data, said, said + 1).any():
        words = f"its header counts {said:,} triangles; the {there:,} that it has are read"
        say_once(path, words)
        if _are_triangles(data, 0, there).mean() < _LARGEST:
            raise BodyError(f"{path}: it is neither text that begins with `solid` nor a binary STL")
        said = there
    return data[:80] + struct.pack("<I", said) + data[_HEADER : _HEADER + _TRIANGLE * said]


def _are_triangles(data: bytes, first: int, last: int) -> Mask:
    """Whether records of a binary STL can be triangles; empty where the file has none there."""
    last = min(last, (len(data) - _HEADER) // _TRIANGLE)
    shape, start = (max(0, last - first), 12), _HEADER + _TRIANGLE * first
    values = np.ndarray(shape, "<f4", data, min(start, len(data)), (_TRIANGLE, 4))
    with np.errstate(all="ignore"):  # other bytes are numbers of any size
        normal = np.linalg.norm(values[:, :3].astype(np.float64), axis=1)
        corners = np.ptp(values[:, 3:].reshape(-1, 3, 3), axis=1).max(axis=1, initial=0.0)
        return np.asarray((normal <= 1.01) & (corners > 0.0) & (corners < 1e12), dtype=np.bool_)


def _text(data: bytes, *, lower: bool) -> bytes:
    """Text in UTF-8 with line ends and decimal points as readers expect them."""
    data = _decoded(data).replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    if lower:
        data = data.lower()
    start = [line[1] for line in itertools.islice(_POINTS.finditer(data), _LINES)]
    if any(b"," in line for line in start) and not any(b"." in line for line in start):
        data = _POINTS.sub(lambda line: _COMMA.sub(b".", line[0]), data)
    return data


def _decoded(data: bytes) -> bytes:
    """Bytes of text in UTF-8, or in an older code that has the same digits and keywords."""
    for mark, codec in _MARKS:
        if data.startswith(mark):
            return data.decode(codec, errors="replace").encode()
    for codec, zeros in (("utf-16-le", data[1:64:2]), ("utf-16-be", data[0:64:2])):
        if len(zeros) > 1 and not any(zeros):
            return data.decode(codec, errors="replace").encode()
    return data
