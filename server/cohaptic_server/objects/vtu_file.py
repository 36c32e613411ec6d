"""Reads the unstructured grid of a `.vtu` file: XML with arrays as text, base64 or raw bytes.

meshio reads the last of several pieces, leaves out the cells that it does not know, and refuses
versions of the format that differ in nothing that is read here. Parallel solvers write a piece for
each of their processes, and each piece has the points of its border for itself.

The format is described in "VTK file formats", docs.vtk.org.
"""

from __future__ import annotations

import base64
import lzma
import re
import zlib
from collections.abc import Container, Iterable, Sequence
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree as ET

import numpy as np
import numpy.typing as npt

from cohaptic.errors import BodyError, one_line
from cohaptic_server.numeric import Floats
from cohaptic_server.objects.memory_limit import say_once
from cohaptic_server.objects.volume_cells import whole
from cohaptic_server.objects.vtk_cells import Grid

_TYPES = {
    "Int8": "i1", "UInt8": "u1", "Int16": "i2", "UInt16": "u2", "Int32": "i4", "UInt32": "u4",
    "Int64": "i8", "UInt64": "u8", "Float32": "f4", "Float64": "f8",
}  # fmt: skip
_NONE = np.zeros(0, dtype=np.int64)
_APPENDED = re.compile(rb"<AppendedData\b[^>]*>\s*_")
_UNPACKERS = {"vtkZLibDataCompressor": "zlib", "vtkLZMADataCompressor": "lzma"}
_INSTEAD = {
    "PUnstructuredGrid": "it only names the files that have the pieces of a mesh. Open it in"
    " ParaView, and save it from there as one .vtu",
    "PolyData": "it has a surface (PolyData). Save that as STL or PLY",
}


def read_vtu(path: Path, wanted: Container[str]) -> Grid:
    """Read all pieces of a file as one grid; the points of their borders are there several times.

    Args:
        wanted: Names, in lower case, of the arrays of cells to read.

    Raises:
        BodyError: The file has something else than an unstructured grid.
        Exception: The file is damaged; errors of many kinds.
    """
    data = path.read_bytes()
    text, appended = data, b""
    start = _APPENDED.search(data)
    if start is not None:
        end = data.rfind(b"</AppendedData")
        if end < start.end() or _APPENDED.search(data, start.end()):
            raise ValueError("its appended data do not end, or are there twice")
        text, appended = data[: start.end()] + data[end:], data[start.end() : end]
    if b"<!ENTITY" in text:
        raise ValueError("it declares entities, which can grow without bound")
    root = ET.fromstring(text)  # without entities, and in limited memory
    kind = one_line(str(root.get("type")), 40)
    if root.tag != "VTKFile" or kind != "UnstructuredGrid":
        words = _INSTEAD.get(
            kind, f"it is a {kind}. Save tetrahedra as an unstructured grid (.vtu)"
        )
        raise BodyError(f"{path}: {words}")
    (grid,) = _only(root, "UnstructuredGrid", ("AppendedData",))
    pieces = _only(grid, "Piece", ("FieldData",), limit=None)
    arrays = _Arrays.of(path, root, appended)
    return _joined(path, [_piece(arrays, piece, wanted) for piece in pieces])


def _only(
    above: ET.Element, tag: str, beside: Iterable[str], least: int = 1, limit: int | None = 1
) -> list[ET.Element]:
    """Elements of one tag, so many at least and at most; others must be among `beside`."""
    found = [one for one in above if one.tag == tag]
    unknown = [str(one.tag) for one in above if one.tag != tag and one.tag not in beside]
    if unknown:
        raise ValueError(f"its {above.tag} has an element {unknown[0][:40]!r}, which is unknown")
    if len(found) < least or (limit is not None and len(found) > limit):
        raise ValueError(f"its {above.tag} has {len(found)} elements {tag!r}")
    return found


class _Arrays(NamedTuple):
    """How a file stores its arrays.

    Args:
        order: `<` or `>`, the order of bytes.
        header: Type of the numbers before an array, which give its length.
        unpack: `zlib`, `lzma`, or an empty text.
        appended: Arrays at the end of the file.
        raw: Whether these are bytes; else they are in base64.
    """

    order: str
    header: np.dtype[np.unsignedinteger]
    unpack: str
    appended: bytes
    raw: bool

    @classmethod
    def of(cls, path: Path, root: ET.Element, appended: bytes) -> _Arrays:
        """What the first element of a file says about all arrays."""
        packer = root.get("compressor", "")
        if packer and packer not in _UNPACKERS:
            raise BodyError(
                f"{path}: its arrays are packed by {one_line(packer, 40)!r}, which is not read."
                " Save it from ParaView with the compressor ZLib or none"
            )
        order = ">" if root.get("byte_order") == "BigEndian" else "<"
        header = _type(root.get("header_type", "UInt32"), order)
        if header.kind != "u":
            raise ValueError("the type of its headers is no unsigned number")
        behind = root.find("AppendedData")
        raw = behind is not None and behind.get("encoding") == "raw"
        unpack = _UNPACKERS.get(packer, "")
        return cls(order, header, unpack, appended if raw else appended.strip(), raw)

    def read(self, array: ET.Element, count: int) -> npt.NDArray[np.float64 | np.int64]:
        """The numbers of an array, shape (count,).

        Raises:
            ValueError: It has another number of them.
        """
        name, kind = array.get("Name", ""), _type(array.get("type", ""), self.order)
        # ParaView keeps the range of the values in elements within an array.
        text = "".join([array.text or "", *(one.tail or "" for one in array)])
        form = array.get("format", "ascii")
        if form == "ascii":
            if "_" in text:  # which Python would take for a part of a number
                raise ValueError(f"its array {name[:40]!r} has a '_' in a number")
            found = np.array(text.split(), dtype=np.float64)
        else:
            limit = count * kind.itemsize
            if form == "binary":
                data = self._block("".join(text.split()).encode(), 0, limit, raw=False)
            elif form == "appended":
                data = self._block(self.appended, int(array.get("offset", "")), limit, raw=self.raw)
            else:
                raise ValueError(f"its array {name[:40]!r} has the format {form[:40]!r}")
            found = np.frombuffer(data, kind)
        if len(found) != count:
            raise ValueError(f"its array {name[:40]!r} has {len(found):,} numbers of {count:,}")
        return whole(found) if kind.kind in "iu" else found.astype(np.float64)

    def _block(self, source: bytes, at: int, limit: int, *, raw: bool) -> bytes:
        """The bytes of an array that begins at a byte, or at a character of base64."""
        if not 0 <= at <= len(source):
            raise ValueError(f"an array begins at {at:,} of {len(source):,}")
        size = self.header.itemsize
        (first,) = self._header(source, at, 1, raw=raw)
        if not self.unpack:
            _check_length(first, limit)
            if raw:
                return _cut(source, at + size, first)
            # Most programs encode the length and the array as one, some each for itself.
            apart = b"=" in source[at : at + _characters(size)]
            if apart:
                return _decoded(source, at + _characters(size), first)
            return _decoded(source, at, size + first)[size:]
        if first == 0:
            return b""
        if first > len(source):
            raise ValueError(f"an array is packed in {first:,} blocks")
        _, each, last, *packed = self._header(source, at, 3 + first, raw=raw)
        lengths = [each] * (first - 1) + [last or each]
        _check_length(sum(lengths), limit)
        behind = (3 + first) * size
        if raw:
            body = _cut(source, at + behind, sum(packed))
        else:
            body = _decoded(source, at + _characters(behind), sum(packed))
        ends = np.cumsum([0, *packed]).tolist()
        blocks = zip(ends[:-1], ends[1:], lengths, strict=True)
        return b"".join(self._unpacked(body[a:b], length) for a, b, length in blocks)

    def _header(self, source: bytes, at: int, count: int, *, raw: bool) -> list[int]:
        size = count * self.header.itemsize
        data = _cut(source, at, size) if raw else _decoded(source, at, size)
        return [int(n) for n in np.frombuffer(data, self.header)]

    def _unpacked(self, packed: bytes, length: int) -> bytes:
        """One block, of which no more is unpacked than it should have."""
        if not length:  # which would be no limit
            return b""
        if self.unpack == "zlib":
            data = zlib.decompressobj().decompress(packed, length)
        else:
            data = lzma.LZMADecompressor().decompress(packed, length)
        return _cut(data, 0, length)


def _type(name: str, order: str) -> np.dtype[np.unsignedinteger]:
    if name not in _TYPES:
        raise ValueError(f"it has numbers of the type {name[:40]!r}")
    return np.dtype(order + _TYPES[name])


def _check_length(length: int, limit: int) -> None:
    if length != limit:
        raise ValueError(f"an array has {length:,} bytes of {limit:,}")


def _cut(source: bytes, at: int, length: int) -> bytes:
    found = source[at : at + length]
    if len(found) < length:
        raise ValueError(f"an array ends after {len(found):,} of {length:,} bytes")
    return found


def _characters(length: int) -> int:
    """Number of characters that bytes have in base64."""
    return -(-length // 3) * 4


def _decoded(source: bytes, at: int, length: int) -> bytes:
    """Bytes of a text in base64 from one of its characters on."""
    text = source[at : at + _characters(length)]
    return _cut(base64.b64decode(text, validate=True), 0, length)


def _piece(arrays: _Arrays, piece: ET.Element, wanted: Container[str]) -> Grid:
    """The grid of one piece; one without points and cells may have no arrays either."""
    points, cells = (int(piece.get(f"NumberOf{what}", "")) for what in ("Points", "Cells"))
    if min(points, cells) < 0:
        raise ValueError(f"a piece has {points} points and {cells} cells")
    beside = {"Points", "Cells", "PointData", "CellData"}
    x, corners, ends, types = np.zeros(0), _NONE, _NONE, _NONE
    for place in _only(piece, "Points", beside, least=min(points, 1)):
        for array in _only(place, "DataArray", (), least=min(points, 1)):
            x = np.asarray(arrays.read(array, 3 * points), dtype=np.float64)
    for topology in _only(piece, "Cells", beside, least=min(cells, 1)):
        named = _named(topology)
        if cells or named:
            ends = whole(arrays.read(named["offsets"], cells))
            types = whole(arrays.read(named["types"], cells))
            length = int(ends[-1]) if cells else 0
            corners = whole(arrays.read(named["connectivity"], length))
    if len(corners) and not 0 <= corners.min() <= corners.max() < points:
        wrong = corners.min() if corners.min() < 0 else corners.max()
        raise ValueError(f"a cell names vertex {wrong} of {points:,} in its piece")
    data: dict[str, Floats] = {}
    for values in _only(piece, "CellData", beside, least=0):
        for name, array in _named(values).items():
            if name.lower() in wanted:
                width = int(array.get("NumberOfComponents") or 1)
                read = np.asarray(arrays.read(array, width * cells), dtype=np.float64)
                data[name] = read if width == 1 else read.reshape(cells, width)
    return Grid(x.reshape(-1, 3), corners, ends, types, data)


def _named(above: ET.Element) -> dict[str, ET.Element]:
    """Arrays of an element by their names.

    Raises:
        ValueError: Two have one name, as with several steps of time.
    """
    found: dict[str, ET.Element] = {}
    for array in _only(above, "DataArray", ("Array",), least=0, limit=None):
        name = array.get("Name", "")
        if name in found:
            raise ValueError(f"its {above.tag} has two arrays {name[:40]!r}")
        found[name] = array
    return found


def _joined(path: Path, pieces: Sequence[Grid]) -> Grid:
    """All pieces as one grid; an array that only some pieces have is left out, and said."""
    full = [piece for piece in pieces if len(piece.types)]
    known = list(dict.fromkeys(name for piece in full for name in piece.data))
    shared = [name for name in known if all(name in piece.data for piece in full)]
    for name in known:
        if name not in shared:
            words = f"its array {one_line(name, 40)!r} is not in all pieces, and is left out"
            say_once(path, words)
    points = np.cumsum([0, *(len(piece.x) for piece in pieces)])
    corners = np.cumsum([0, *(len(piece.corners) for piece in pieces)])
    return Grid(
        np.concatenate([piece.x for piece in pieces]),
        np.concatenate([one.corners + n for one, n in zip(pieces, points, strict=False)]),
        np.concatenate([one.ends + n for one, n in zip(pieces, corners, strict=False)]),
        np.concatenate([piece.types for piece in pieces]),
        {name: np.concatenate([piece.data[name] for piece in full]) for name in shared},
    )
