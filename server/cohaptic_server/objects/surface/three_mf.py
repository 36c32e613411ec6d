"""What a 3MF file holds, found before it is unpacked: its unit, and how many triangles it makes.

A 3MF is a zip of XML in which objects are made of other objects. A file of a megabyte can hold
gigabytes of text, or name an object a billion times: both are refused from the count alone.
"""

from __future__ import annotations

import zipfile
from collections import Counter, defaultdict
from pathlib import Path
from typing import IO, NamedTuple
from xml.parsers import expat

from cohaptic.errors import BodyError, one_line

MAX_BYTES = 2**29  # unpacked; the XML of a million triangles takes a tenth of it
MAX_BUILT = 5_000_000  # triangles to be read; with --simplify a scan may have so many
_MAX_DEPTH = 50  # of objects within objects
# Metres in each unit of the specification.
_METRES = {
    "micron": 1e-6,
    "millimeter": 1e-3,
    "centimeter": 1e-2,
    "inch": 0.0254,
    "foot": 0.3048,
    "meter": 1.0,
}


class Model(NamedTuple):
    """What a 3MF file says of itself.

    Args:
        metres: In one unit of its coordinates.
        triangles: Of everything that is to be built.
    """

    metres: float
    triangles: int


def look_into(path: Path) -> Model:
    """Read the unit and the number of triangles of a 3MF file.

    Raises:
        BodyError: It is no 3MF, would be too large, or its objects contain each other.
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
            whole = _Objects()
            for part in parts:
                if part.filename.lower().endswith(".model"):
                    whole.read(archive.open(part))
    except BodyError:
        raise
    except Exception as error:  # zipfile raises errors of many kinds, for passwords another one
        words = one_line(f"{type(error).__name__}: {error}")
        raise BodyError(f"{path}: this is no 3MF that can be read ({words})") from error
    triangles = whole.triangles(path)
    if triangles > MAX_BUILT:
        raise BodyError(
            f"{path}: it would have {triangles:,} triangles; the limit is {MAX_BUILT:,}."
            " Simplify it first"
        )
    if whole.unit not in _METRES:
        raise BodyError(f"{path}: its unit is {whole.unit!r}; known are: {', '.join(_METRES)}")
    return Model(_METRES[whole.unit], triangles)


class _Objects:
    """Objects of a file: triangles of their own, and the objects that each is made of.

    Two of one name, in one model or in two, count together, so that none hides another.
    """

    def __init__(self) -> None:
        self.unit = "millimeter"  # where a file does not say
        self.own: Counter[str] = Counter()
        self.made_of: defaultdict[str, Counter[str]] = defaultdict(Counter)
        self.built: Counter[str] = Counter()

    def read(self, text: IO[bytes]) -> None:
        """Take in one model, as its text goes by: no tree is built of it."""
        current, unit = "", self.unit

        def start(name: str, values: dict[str, str]) -> None:
            nonlocal current, unit
            tag = name.rpartition(":")[2]
            if tag == "model":
                unit = values.get("unit", unit)
            elif tag == "object":
                current = values.get("id", "")
            elif tag == "triangle":
                self.own[current] += 1
            elif tag == "component":
                self.made_of[current][values.get("objectid", "")] += 1
            elif tag == "item":
                self.built[values.get("objectid", "")] += 1
                self.unit = unit  # that of the model which builds something

        def refuse(*_: object) -> None:
            raise expat.ExpatError("it declares entities, which can grow without bound")

        parser = expat.ParserCreate()
        parser.StartElementHandler, parser.EntityDeclHandler = start, refuse
        parser.ParseFile(text)

    def triangles(self, path: Path) -> int:
        """Triangles of everything that is built, each object as often as it is named."""
        known: dict[str, int] = {}

        def count(name: str, depth: int) -> int:
            if depth > _MAX_DEPTH:
                raise BodyError(
                    f"{path}: its objects lie more than {_MAX_DEPTH} deep in each other"
                )
            if name not in known:
                inside: Counter[str] = self.made_of.get(name, Counter())
                parts = (times * count(part, depth + 1) for part, times in inside.items())
                known[name] = self.own[name] + sum(parts)
            return known[name]

        return sum(times * count(name, 0) for name, times in self.built.items())
