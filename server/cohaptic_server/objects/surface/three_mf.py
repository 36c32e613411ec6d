"""Finds the unit and the number of triangles of a 3MF file before its meshes are built.

A 3MF is a zip of XML in which objects are made of other objects. A file of a megabyte can hold
gigabytes of text, or name an object a billion times: both are refused from the counts alone. A file
that the reader (trimesh) would turn into another body is refused, too: trimesh knows objects by
their number alone, whichever part of the archive contains them, and it reads a whole part for each
object that is named there.
"""

from __future__ import annotations

import zipfile
from collections import Counter, defaultdict
from pathlib import Path
from typing import IO, NamedTuple, TypeAlias
from xml.parsers import expat

from cohaptic.errors import BodyError
from cohaptic_server.objects.memory_limit import unreadable
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
_ROOT = "3d/3dmodel.model"  # part that lists the objects to build; trimesh also finds it by name
_Key: TypeAlias = tuple[str, str]  # part of the archive, and number of an object there


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
        BodyError: The file is not a 3MF or is too large; or its objects contain each other, are
            missing, or cannot be told apart by the reader.
    """
    try:
        with zipfile.ZipFile(path) as archive:
            parts = archive.infolist()
            size = sum(part.file_size for part in parts)
            if size > MAX_BYTES:
                raise BodyError(
                    f"{path}: unpacked it has {size / 2**20:,.0f} MiB; the limit is"
                    f" {MAX_BYTES / 2**20:,.0f} MiB. Simplify it first"
                )
            names = archive.namelist()
            root = next((name for name in names if _ROOT in name.lower()), None)
            if root is None:
                raise BodyError(f"{path}: there is no model in it: it is a zip, and no 3MF")
            whole = _Objects(root)
            while part := whole.unread():
                if part in names:
                    whole.read(part, archive.open(part))
    except BodyError:
        raise
    except Exception as error:  # zipfile raises errors of many kinds, one more for passwords
        raise unreadable(path, "3MF", error) from error
    why = whole.mixed_up()
    if why:
        raise BodyError(f"{path}: {why}. Export it as one mesh, for example as STL")
    triangles, named = whole.built(path)
    if triangles > MAX_READ or named > _MAX_NAMED:
        raise BodyError(
            f"{path}: it would have {triangles:,} triangles in {named:,} objects; the limits are"
            f" {MAX_READ:,} and {_MAX_NAMED:,}. Simplify it first"
        )
    if whole.unit not in _METRES:
        raise BodyError(f"{path}: its unit is {whole.unit!r}; known are: {', '.join(_METRES)}")
    return Model(_METRES[whole.unit], triangles)


class _Objects:
    """Objects of a file: the triangles of each, and the objects that each is made of.

    Two objects with the same number in a part are counted together, so that neither hides the
    other.

    Args:
        root: Name of the part that lists the objects to build.
    """

    def __init__(self, root: str) -> None:
        self.unit = "millimeter"  # unit of a file that declares none
        self.root = root
        self.own: Counter[_Key] = Counter()
        self.made_of: defaultdict[_Key, Counter[_Key]] = defaultdict(Counter)
        self.items: Counter[_Key] = Counter()
        self.parts = {root: False}  # whether each part has been read

    def unread(self) -> str | None:
        """Mark a part that is not read yet as read, and return its name; None if all are read."""
        name = next((name for name, read in self.parts.items() if not read), None)
        if name is not None:
            self.parts[name] = True
        return name

    def read(self, part: str, text: IO[bytes]) -> None:
        """Read one part as a stream, without building a tree of its XML."""
        current = (part, "")

        def named(values: dict[str, str]) -> _Key:
            there = next((v.strip("/") for k, v in values.items() if k.endswith("path")), part)
            self.parts.setdefault(there, False)
            return there, values.get("objectid", "")

        def start(name: str, values: dict[str, str]) -> None:
            nonlocal current
            tag = name.rpartition(":")[2]
            if tag == "model" and part == self.root:
                self.unit = values.get("unit", self.unit)
            elif tag == "object":
                current = (part, values.get("id", ""))
                self.own[current] += 0
            elif tag == "triangle":
                self.own[current] += 1
            elif tag == "component":
                self.made_of[current][named(values)] += 1
            elif tag == "item" and part == self.root:
                self.items[named(values)] += 1

        def refuse(*_: object) -> None:
            raise expat.ExpatError("it declares entities, which can grow without bound")

        parser = expat.ParserCreate()
        parser.StartElementHandler, parser.EntityDeclHandler = start, refuse
        parser.ParseFile(text)

    def mixed_up(self) -> str:
        """Reason why the reader would build another body; empty if it builds the right one."""
        named = Counter[_Key](self.items)
        for inside in self.made_of.values():
            named += inside
        for (part, number), times in named.items():
            if (part, number) not in self.own:
                return f"it names object {number[:20]!r}, which is not there"
            if part != self.root and (
                times > 1
                or (part, number) in self.items
                or sum(there == part for there, _ in self.own) > 1
                or sum(other == number for _, other in self.own) > 1
            ):
                return (
                    f"object {number[:20]!r} of its part {part[:60]!r} cannot be told from others"
                )
        return ""

    def built(self, path: Path) -> tuple[int, int]:
        """Number of triangles and of objects to build; objects count as often as they are named."""
        known: dict[_Key, tuple[int, int]] = {}

        def count(key: _Key, depth: int) -> tuple[int, int]:
            if depth > _MAX_DEPTH:
                raise BodyError(
                    f"{path}: its objects lie more than {_MAX_DEPTH} deep in each other"
                )
            if key not in known:
                triangles, named = self.own[key], 1
                for part, times in self.made_of.get(key, Counter[_Key]()).items():
                    more = count(part, depth + 1)
                    triangles, named = triangles + times * more[0], named + times * more[1]
                known[key] = triangles, named
            return known[key]

        each = [(times, count(key, 0)) for key, times in self.items.items()]
        return sum(n * one[0] for n, one in each), sum(n * one[1] for n, one in each)
