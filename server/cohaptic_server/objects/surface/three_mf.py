"""Reads the triangles of a 3MF file, whose objects may lie in parts of their own.

A 3MF is a zip of XML in which objects are made of other objects; slicers keep objects in parts that
are named by path (the production extension). A file of a megabyte can hold gigabytes of text, or
name an object a billion times: both are refused from the counts alone, before a mesh is built.
"""

from __future__ import annotations

import zipfile
from array import array
from collections import Counter, defaultdict
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import IO, NamedTuple, TypeAlias
from xml.parsers import expat

import numpy as np

from cohaptic.errors import BodyError
from cohaptic_server.numeric import Floats, Ints
from cohaptic_server.objects.memory_limit import reading_limited, say_once, unreadable
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
_MAX_PARTS = 10_000  # parts with objects that a file may name
_CHUNK, _LONGEST_TAG = 2**16, 2**20  # bytes
# Ends of the names of extensions that a file may require: the production extension is read, the
# others concern the look.
_READ_EXTENSIONS = ("/production/2015/06", "/material/2015/02", "/trianglesets/2021/07")
_OTHER_SHAPES = {"beamlattice", "booleanshape", "displacementmesh", "levelset"}
_NO_SHAPE = {"other", "support", "solidsupport"}  # types of objects that a slicer keeps beside it
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
            names = set(archive.namelist())
            root = next((name for name in archive.namelist() if _ROOT in name.lower()), None)
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
        raise BodyError(f"{path}: its unit is {whole.unit[:20]!r}; known are: {', '.join(_METRES)}")
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
        self._left_out = set[_Key]()  # objects that are no part of the shape
        self._known, self._unread = {root}, [root]  # parts

    def unread(self) -> str | None:
        """Name of a part that has not been read yet; None if there is none."""
        return self._unread.pop() if self._unread else None

    # Above 60 lines: the handlers of one parse share the object that is being read.
    def read(self, part: str, text: IO[bytes]) -> None:
        """Read one part as a stream, without building a tree of its XML."""
        current, own = (part, ""), ""
        points, corners = array("d"), array("q")
        spaces: dict[str | None, str] = {}

        def named(values: dict[str, str]) -> tuple[_Key, _Transform]:
            there = next((v.strip("/") for k, v in values.items() if k.endswith("path")), part)
            if there not in self._known:
                self._known.add(there)
                self._unread.append(there)
            if len(self._known) > _MAX_PARTS:
                raise BodyError(f"{self._path}: it names more than {_MAX_PARTS:,} parts")
            return (there, values.get("objectid", "")), _transform(values.get("transform"))

        def start(name: str, values: dict[str, str]) -> None:
            nonlocal current, own, points, corners
            space, _, tag = name.rpartition(" ")
            if tag == "model":
                own = space
                self._check_required(values.get("requiredextensions", ""), spaces)
                if part == self._root:
                    self.unit = values.get("unit", self.unit)
            elif tag in _OTHER_SHAPES:
                raise BodyError(
                    f"{self._path}: it has a {tag}, which is not read. Export it as a mesh, for"
                    " example as STL"
                )
            elif space != own:
                return  # an extension's, which concerns colours or slices
            elif tag == "vertex":
                points.extend((float(values["x"]), float(values["y"]), float(values["z"])))
            elif tag == "triangle":
                corners.extend((int(values["v1"]), int(values["v2"]), int(values["v3"])))
            elif tag == "object":
                current = (part, values.get("id", ""))
                if current in self._meshes:
                    raise BodyError(f"{self._path}: it has two objects {current[1][:20]!r}")
                points, corners = self._meshes[current] = array("d"), array("q")
                if values.get("type", "model") in _NO_SHAPE:
                    self._left_out.add(current)
                    words = "supports and modifiers of its slicer are left out"
                    say_once(self._path, words)
            elif tag == "component":
                self._made_of[current].append(named(values))
            elif tag == "item" and part == self._root:
                self._items.append(named(values))
            if len(points) + len(corners) > 6 * MAX_READ:
                raise BodyError(
                    f"{self._path}: an object has more than {MAX_READ:,} triangles. Simplify it"
                    " first"
                )

        def refuse(*_: object) -> None:
            raise expat.ExpatError("it declares entities, which can grow without bound")

        parser = expat.ParserCreate(namespace_separator=" ")
        parser.StartElementHandler, parser.EntityDeclHandler = start, refuse
        parser.StartNamespaceDeclHandler = spaces.__setitem__
        fed = 0
        while chunk := text.read(_CHUNK):
            parser.Parse(chunk, False)
            fed += len(chunk)
            # Some parsers read an unfinished tag again with each piece of it.
            if fed - parser.CurrentByteIndex > _LONGEST_TAG:
                raise expat.ExpatError("it has a tag of more than a megabyte")
        parser.Parse(b"", True)

    def _check_required(self, prefixes: str, spaces: dict[str | None, str]) -> None:
        """Refuse an extension that the file requires and that is not read here."""
        for prefix in prefixes.split():
            space = spaces.get(prefix, prefix)
            if not space.endswith(_READ_EXTENSIONS):
                raise BodyError(
                    f"{self._path}: it requires the extension {space[-60:]!r}, which is not read."
                    " Export it as a mesh, for example as STL"
                )

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
                left_out = key in self._left_out
                triangles, named = 0 if left_out else len(self._meshes[key][1]) // 3, 1
                inside = Counter(part for part, _ in self._inside(key))
                for part, times in inside.items():
                    more = count(part, depth + 1)
                    triangles, named = triangles + times * more[0], named + times * more[1]
                known[key] = triangles, named
            return known[key]

        each = [count(key, 0) for key, _ in self._items]
        return sum(one[0] for one in each), sum(one[1] for one in each)

    def _inside(self, key: _Key) -> Sequence[tuple[_Key, _Transform]]:
        """Objects that an object is made of; none if it is left out."""
        return () if key in self._left_out else self._made_of.get(key, ())

    def built(self) -> Iterator[tuple[Floats, Ints]]:
        """Vertices and triangles of each object to build, in the units of the file."""
        todo = [(key, _matrix(transform)) for key, transform in reversed(self._items)]
        while todo:
            key, matrix = todo.pop()
            inside = self._inside(key)
            todo += [(part, _matrix(own) @ matrix) for part, own in reversed(inside)]
            points, corners = self._meshes[key]
            if corners and key not in self._left_out:
                x = np.array(points).reshape(-1, 3)
                faces = np.array(corners, dtype=np.int64).reshape(-1, 3)
                if faces.min() < 0 or faces.max() >= len(x):
                    wrong = faces.min() if faces.min() < 0 else faces.max()
                    raise BodyError(f"{self._path}: a triangle names vertex {wrong} of {len(x)}")
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
