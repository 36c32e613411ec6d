"""Reads the unstructured grid of a legacy `.vtk` file, text or binary, versions 1.0 to 5.1.

meshio refuses arrays of types that VTK itself writes, and cells that it does not know. What a file
has behind its cells is fields; of these only numbers of parts are of use here, so reading ends
where something comes that is unknown, which is said if it may hide such numbers.

The format is described in "VTK file formats", docs.vtk.org.
"""

from __future__ import annotations

from collections.abc import Container
from pathlib import Path
from typing import Any
from urllib.parse import unquote_to_bytes

import numpy as np

from cohaptic.errors import BodyError, one_line
from cohaptic_server.numeric import Floats, Ints
from cohaptic_server.objects.memory_limit import say_once
from cohaptic_server.objects.volume_cells import whole
from cohaptic_server.objects.vtk_cells import Grid

# Numbers in binary files have the most significant byte first.
_TYPES = {
    "char": "i1", "signed_char": "i1", "unsigned_char": "u1", "vtktypeuint8": "u1",
    "vtktypeint8": "i1", "short": ">i2", "vtktypeint16": ">i2", "unsigned_short": ">u2",
    "vtktypeuint16": ">u2", "int": ">i4", "vtktypeint32": ">i4", "unsigned_int": ">u4",
    "vtktypeuint32": ">u4", "long": ">i8", "vtktypeint64": ">i8", "vtkidtype": ">i4",
    "unsigned_long": ">u8", "vtktypeuint64": ">u8", "float": ">f4", "vtktypefloat32": ">f4",
    "double": ">f8", "vtktypefloat64": ">f8",
}  # fmt: skip
_WIDTHS = {"vectors": 3, "normals": 3, "tensors": 9, "tensors6": 6, "global_ids": 1,
           "pedigree_ids": 1, "edge_flags": 1}  # fmt: skip


def read_vtk(path: Path, wanted: Container[str]) -> Grid:
    """Read a file that begins with `# vtk DataFile`.

    Args:
        wanted: Names, in lower case, of the arrays of cells to read.

    Raises:
        BodyError: The file has something else than an unstructured grid.
        Exception: The file is damaged; errors of many kinds.
    """
    data = path.read_bytes()
    if not data.lstrip().lower().startswith(b"# vtk datafile"):
        raise ValueError("it does not begin with `# vtk DataFile`")
    lines = data.split(b"\n", 3)
    form = lines[2].strip().upper() if len(lines) > 3 else b""
    if form not in (b"ASCII", b"BINARY"):
        raise ValueError("its third line says neither ASCII nor BINARY")
    return _Reader(path, lines[3], binary=form == b"BINARY", wanted=wanted).grid()


class _Reader:
    """Sections of one file, one after another.

    Args:
        data: The file behind its third line.
        wanted: Names, in lower case, of the arrays of cells to keep.
    """

    def __init__(self, path: Path, data: bytes, *, binary: bool, wanted: Container[str]) -> None:
        self._path, self._data, self._binary, self._wanted = path, data, binary, wanted
        self._at = 0
        self._kind: str | None = None
        self._x: Floats | None = None
        self._corners: Ints | None = None
        self._ends: Ints = np.zeros(0, dtype=np.int64)
        self._types: Ints | None = None
        self._about, self._count = "", 0  # what values are of, and their number
        self._kept: dict[str, Floats] = {}

    def grid(self) -> Grid:
        """Read all sections."""
        while words := self._words():
            if not self._section(words):
                self._stop(words[0])
                break
        if self._x is None or self._corners is None or self._types is None or not self._kind:
            raise ValueError("it has no DATASET, no POINTS, no CELLS or no CELL_TYPES")
        if len(self._corners) and not 0 <= self._corners.min() <= self._corners.max() < len(
            self._x
        ):
            wrong = self._corners[(self._corners < 0) | (self._corners >= len(self._x))][0]
            raise ValueError(f"a cell names vertex {wrong} of {len(self._x):,}")
        return Grid(self._x, self._corners, self._ends, self._types, self._kept)

    def _stop(self, word: str) -> None:
        """Stop at something unknown, which is an error if it may be a part of the mesh."""
        said = repr(one_line(word, 40))
        if self._x is None or self._corners is None or self._types is None or not word[0].isalpha():
            raise ValueError(f"{said} stands where a section should begin")
        say_once(self._path, f"its values from {said} on are not read, with parts if it has any")

    def _section(self, words: list[str]) -> bool:
        """Read what a line begins; False if it is unknown."""
        name, *said = words
        name = name.lower()
        if name == "dataset":
            self._check_kind(one_line(said[0], 40).upper())
        elif name == "points":
            _once(name, self._x)
            self._x = self._numbers(said[1], 3 * _size(said[0])).reshape(-1, 3)
        elif name == "cells":
            _once(name, self._corners)
            self._read_cells(_size(said[0]), _size(said[1]))
        elif name == "cell_types":
            _once(name, self._types)
            self._types = whole(self._numbers("int", _size(said[0])))
        elif name in ("cell_data", "point_data"):
            self._about, self._count = name, _size(said[0])
            if name == "cell_data" and self._types is not None and self._count != len(self._types):
                raise BodyError(
                    f"{self._path}: it has values for {self._count:,} cells, and"
                    f" {len(self._types):,} cells. Export it anew"
                )
        elif name == "metadata":
            while self._words(blank=True):
                pass
        else:
            try:
                return self._values(name, said)
            except (ValueError, LookupError):  # damaged, or of a type that is not known
                return False
        return True

    def _check_kind(self, kind: str) -> None:
        if kind == "POLYDATA":
            raise BodyError(f"{self._path}: it has a surface (POLYDATA). Save that as STL or PLY")
        if kind != "UNSTRUCTURED_GRID":
            raise BodyError(
                f"{self._path}: it is a grid of points ({kind}). Save tetrahedra as .vtu"
            )
        _once("dataset", self._kind)
        self._kind = kind

    def _read_cells(self, count: int, size: int) -> None:
        at = self._at
        words = self._words()
        if words and words[0].lower() == "offsets":  # version 5.1
            starts = whole(self._numbers(words[1], count))
            named = self._words()
            if not named or named[0].lower() != "connectivity" or (count and starts[0]):
                raise ValueError("its cells have no OFFSETS from 0 on, or no CONNECTIVITY")
            self._ends, self._corners = starts[1:], whole(self._numbers(named[1], size))
            return
        self._at = at
        numbers = whole(self._numbers("int", size))
        # Each cell is the number of its points, and then these.
        sizes: list[int] = []
        place = 0
        for _ in range(count):
            if place >= size or numbers[place] < 0:
                raise ValueError(f"its {count:,} cells do not fit into {size:,} numbers")
            sizes.append(int(numbers[place]))
            place += 1 + sizes[-1]
        if place != size:
            raise ValueError(f"its {count:,} cells have {place:,} of {size:,} numbers")
        self._ends = np.cumsum(np.array(sizes, dtype=np.int64))
        counts = self._ends - np.array(sizes, dtype=np.int64) + np.arange(count)
        self._corners = np.delete(numbers, counts)

    def _values(self, name: str, said: list[str]) -> bool:
        """Read values of points or cells, or a field; False if the section is unknown."""
        if name == "scalars":
            width = int(said[2]) if len(said) > 2 else 1
            if self._data[self._at : self._at + 12].lower() == b"lookup_table":
                self._words()
            self._keep(said[0], said[1], width, self._count)
        elif name in _WIDTHS:
            self._keep(said[0], said[1], _WIDTHS[name], self._count)
        elif name == "texture_coordinates":
            self._keep(said[0], said[2], int(said[1]), self._count)
        elif name == "color_scalars":
            self._numbers("unsigned_char", int(said[1]) * self._count)
        elif name == "lookup_table":
            self._numbers("unsigned_char", 4 * _size(said[1]))
        elif name == "field":
            for _ in range(_size(said[1])):
                words = self._words()
                while words and words[0].lower() == "metadata":
                    self._section(words)
                    words = self._words()
                self._keep(words[0], words[3], int(words[1]), _size(words[2]))
        else:
            return False
        return True

    def _keep(self, name: str, kind: str, width: int, count: int) -> None:
        if kind.lower() == "string":
            self._skip_strings(width * count)
            return
        values = self._numbers(kind, width * count)
        name = unquote_to_bytes(name).decode(errors="replace")
        if self._about != "cell_data" or name.lower() not in self._wanted:
            return
        if name in self._kept or self._types is None or count != len(self._types):
            raise BodyError(
                f"{self._path}: its cell data {one_line(name, 40)!r} are there twice, before the"
                " cells, or not for each cell. Export it anew"
            )
        self._kept[name] = values if width == 1 else values.reshape(count, width)

    def _skip_strings(self, count: int) -> None:
        """Read over texts: lines, or in binary files bytes behind their length."""
        for _ in range(count):
            if not self._binary:
                self._words(blank=True)
                continue
            # The first two bits say how many bytes the length has.
            size = (8, 4, 2, 1)[self._data[self._at] >> 6]
            length = int.from_bytes(self._data[self._at : self._at + size], "big")
            self._at += size + length % (1 << (8 * size - 2))
        if self._binary and self._data[self._at : self._at + 1] == b"\n":
            self._at += 1

    def _words(self, *, blank: bool = False) -> list[str]:
        """Words of the next line that has any, or with `blank` of the next line; [] at the end."""
        while self._at < len(self._data):
            end = self._data.find(b"\n", self._at)
            end = len(self._data) if end < 0 else end
            line = self._data[self._at : end].decode(errors="replace").split()
            self._at = end + 1
            if line or blank:
                return line
        return []

    def _numbers(self, kind: str, count: int) -> Floats:
        """The next numbers, shape (count,)."""
        name = _TYPES[kind.lower()] if kind.lower() != "bit" else "u1"
        if count < 0:
            raise ValueError(f"it has {count} numbers")
        if not self._binary:
            window = 32 * (count + 1)  # the whole rest would be copied once for each array
            while True:
                text = self._data[self._at : self._at + window]
                words = text.split(None, count)
                if len(words) > count or self._at + window >= len(self._data):
                    break
                window *= 4
            rest = words[count] if len(words) > count else b""
            text = text[: len(text) - len(rest)]
            self._at += len(text)
            if b"_" in text:  # which Python would take for a part of a number
                raise ValueError("it has a '_' in a number")
            return _all(np.array(words[:count], dtype=np.float64), count)
        if kind.lower() == "bit":
            packed = np.frombuffer(self._data[self._at : self._at - (-count // 8)], "u1")
            found: Any = np.unpackbits(packed)[:count]
            self._at += len(packed)
        else:
            size = np.dtype(name).itemsize
            left = max(0, len(self._data) - self._at) // size
            found = np.frombuffer(self._data, name, min(count, left), self._at)
            self._at += found.nbytes
        if self._data[self._at : self._at + 1] == b"\n":
            self._at += 1
        return _all(np.asarray(found, dtype=np.float64), count)


def _all(found: Any, count: int) -> Floats:
    if len(found) < count:
        raise ValueError(f"it ends after {len(found):,} of {count:,} numbers")
    return np.asarray(found, dtype=np.float64)


def _size(word: str) -> int:
    size = int(word)
    if size < 0:
        raise ValueError(f"it counts {size}")
    return size


def _once(name: str, there: object) -> None:
    if there is not None:
        raise ValueError(f"it has two sections {name.upper()}")
