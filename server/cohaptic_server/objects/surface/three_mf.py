"""Reads the triangles of a 3MF file, whose objects may lie in parts of their own.

A 3MF is a zip of XML in which objects are made of other objects; slicers keep objects in parts that
are named by path (the production extension). A file of a megabyte can hold gigabytes of text, or
name an object a billion times: both are refused from the counts alone, before a mesh is built.
"""

from __future__ import annotations

import zipfile
from array import array
from collections import Counter, defaultdict
from collections.abc import Iterator
from pathlib import Path
from typing import IO, NamedTuple, TypeAlias
from xml.parsers import expat

import numpy as np

from cohaptic.errors import BodyError
from cohaptic_server.numeric import Floats, Ints
from cohaptic_server.objects.memory_limit import reading_limited, unreadable
from cohaptic_server.objects.object_file import MAX_READ

MAX_BYTES = 2**29  # bytes when unpacked; the XML of a million triangles takes a tenth of that
_MAX_DEPTH = 50  # nesting depth of objects within objects
_MAX_NAMED = 100_000  # objects to be built, including all nested ones, even if they are empty
# Metres in each unit of the specification.
_METRES = {
    "micron": 1e-6,
    "millimeter": 1e-3,
    "centimeter": 1e-2,
    "inch": 0.0254,
    "foot": 0.3048,
    "meter": 1.0,
}
_ROOT = "3d/3dmodel.model"  # part that lists the objects to build
_STAYS = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)  # transform of none
_Key: TypeAlias = tuple[str, str]  # part of the archive, and number of an object there
_Transform: TypeAlias = tuple[float, ...]  # four rows of three: x' = x R + t


class Model(NamedTuple):
    """Unit and size of the model in a 3MF file.

    Args:
        metres: Metres in one unit of the coordinates.
        triangles: Number of triangles of all objects that are built.
    """

    metres: float
    triangles: int


def look_into(path: Path) -> Model:
    """Read the unit and the number of triangles of a 3MF file.

    Raises:
        BodyError: The file is not a 3MF or is too large, or its objects contain each other or are
            missing.
    """
    return _read(path)[0]


def read_three_mf(path: Path) -> tuple[Floats, Ints]:
    """Read the vertices, shape (n, 3) [m], and the triangles, shape (m, 3), of all built objects.

    Raises:
        BodyError: As `look_into`.
    """
    model, whole = _read(path)
    points, faces, count = [np.zeros((0, 3))], [np.zeros((0, 3), dtype=np.int64)], 0
    with reading_limited(path):
        for x, triangles in whole.built():
            points.append(model.metres * x)
            faces.append(triangles + count)
            count += len(x)
    return np.concatenate(points), np.concatenate(faces)


def _read(path: Path) -> tuple[Model, _Objects]:
    try:
        with reading_limited(path), zipfile.ZipFile(path) as archive:
            size = sum(part.file_size for part in archive.infolist())
            if size > MAX_BYTES:
                raise BodyError(
                    f"{path}: unpacked it has {size / 2**20:,.0f} MiB; the limit is"
                    f" {MAX_BYTES / 2**20:,.0f} MiB. Simplify it first"
                )
            names = archive.namelist()
            root = next((name for name in names if _ROOT in name.lower()), None)
            if root is None:
                raise BodyError(f"{path}: there is no model in it: it is a zip, and no 3MF")
            whole = _Objects(path, root)
            while part := whole.unread():
                if part in names:
                    whole.read(part, archive.open(part))
    except BodyError:
        raise
    except Exception as error:  # zipfile raises errors of many kinds, one more for passwords
        raise unreadable(path, "3MF", error) from error
    triangles, named = whole.counted()
    if triangles > MAX_READ or named > _MAX_NAMED:
        raise BodyError(
            f"{path}: it would have {triangles:,} triangles in {named:,} objects; the limits are"
            f" {MAX_READ:,} and {_MAX_NAMED:,}. Simplify it first"
        )
    if whole.unit not in _METRES:
        raise BodyError(f"{path}: its unit is {whole.unit!r}; known are: {', '.join(_METRES)}")
    return Model(_METRES[whole.unit], triangles), whole


class _Objects:
    """Objects of a file: the mesh of each, and the objects that each is made of.

    Args:
        path: The file, for errors.
        root: Name of the part that lists the objects to build.
    """

    def __init__(self, path: Path, root: str) -> None:
        self.unit = "millimeter"  # unit of a file that declares none
        self._path, self._root = path, root
        self._meshes: dict[_Key, tuple[array[float], array[int]]] = {}
        self._made_of: defaultdict[_Key, list[tuple[_Key, _Transform]]] = defaultdict(list)
        self._items: list[tuple[_Key, _Transform]] = []
        self._parts = {root: False}  # whether each part has been read

    def unread(self) -> str | None:
        """Mark a part that is not read yet as read, and return its name; None if all are read."""
        name = next((name for name, read in self._parts.items() if not read), None)
        if name is not None:
            self._parts[name] = True
        return name

    def read(self, part: str, text: IO[bytes]) -> None:
        """Read one part as a stream, without building a tree of its XML."""
        current = (part, "")
        points, corners = array("d"), array("q")

        def named(values: dict[str, str]) -> tuple[_Key, _Transform]:
            there = next((v.strip("/") for k, v in values.items() if k.endswith("path")), part)
            self._parts.setdefault(there, False)
            return (there, values.get("objectid", "")), _transform(values.get("transform"))

        def start(name: str, values: dict[str, str]) -> None:
            nonlocal current, points, corners
            tag = name.rpartition(":")[2]
            if tag == "vertex":
                points.extend((float(values["x"]), float(values["y"]), float(values["z"])))
            elif tag == "triangle":
                corners.extend((int(values["v1"]), int(values["v2"]), int(values["v3"])))
            elif tag == "object":
                current = (part, values.get("id", ""))
                if current in self._meshes:
                    raise BodyError(f"{self._path}: it has two objects {current[1][:20]!r}")
                points, corners = self._meshes[current] = array("d"), array("q")
            elif tag == "component":
                self._made_of[current].append(named(values))
            elif tag == "model" and part == self._root:
                self.unit = values.get("unit", self.unit)
            elif tag == "item" and part == self._root:
                self._items.append(named(values))

        def refuse(*_: object) -> None:
            raise expat.ExpatError("it declares entities, which can grow without bound")

        parser = expat.ParserCreate()
        parser.StartElementHandler, parser.EntityDeclHandler = start, refuse
        parser.ParseFile(text)

    def counted(self) -> tuple[int, int]:
        """Number of triangles and of objects to build; objects count as often as they are named."""
        known: dict[_Key, tuple[int, int]] = {}

        def count(key: _Key, depth: int) -> tuple[int, int]:
            if depth > _MAX_DEPTH:
                raise BodyError(
                    f"{self._path}: its objects lie more than {_MAX_DEPTH} deep in each other"
                )
            if key not in self._meshes:
                raise BodyError(
                    f"{self._path}: it names object {key[1][:20]!r}, which is not there. Export it"
                    " as one mesh, for example as STL"
                )
            if key not in known:
                triangles, named = len(self._meshes[key][1]) // 3, 1
                inside = Counter(part for part, _ in self._made_of.get(key, ()))
                for part, times in inside.items():
                    more = count(part, depth + 1)
                    triangles, named = triangles + times * more[0], named + times * more[1]
                known[key] = triangles, named
            return known[key]

        each = [count(key, 0) for key, _ in self._items]
        return sum(one[0] for one in each), sum(one[1] for one in each)

    def built(self) -> Iterator[tuple[Floats, Ints]]:
        """Vertices and triangles of each object to build, in the units of the file."""
        todo = [(key, _matrix(transform)) for key, transform in reversed(self._items)]
        while todo:
            key, matrix = todo.pop()
            inside = self._made_of.get(key, ())
            todo += [(part, _matrix(own) @ matrix) for part, own in reversed(inside)]
            points, corners = self._meshes[key]
            if corners:
                x = np.array(points).reshape(-1, 3)
                faces = np.array(corners, dtype=np.int64).reshape(-1, 3)
                if faces.min() < 0 or faces.max() >= len(x):
                    raise BodyError(
                        f"{self._path}: a triangle names vertex {faces.max()} of {len(x)}"
                    )
                mirrored = np.linalg.det(matrix[:3, :3]) < 0.0
                yield x @ matrix[:3, :3] + matrix[3, :3], faces[:, ::-1] if mirrored else faces


def _transform(said: str | None) -> _Transform:
    """Twelve numbers of a transform; those of none if the file names none."""
    if said is None:
        return _STAYS
    values = tuple(float(one) for one in said.split())
    if len(values) != len(_STAYS):
        raise ValueError(f"a transform of {len(values)} numbers")
    return values


def _matrix(transform: _Transform) -> Floats:
    """Matrix M, shape (4, 4), that moves a row: (x, 1) M."""
    matrix = np.eye(4)
    matrix[:, :3] = np.reshape(transform, (4, 3))
    return matrix
