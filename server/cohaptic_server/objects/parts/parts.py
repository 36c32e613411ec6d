"""The parts of an object: names, surfaces, tetrahedra, and the volume that filling may lose.

Each tetrahedron belongs to one part. Filling that loses more than the limits of volume and shape
allow is an error.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from cohaptic.errors import BodyError
from cohaptic_server.mesh.tetrahedra import TetMesh, volumes
from cohaptic_server.numeric import Floats, Ints

MAX_PARTS = 64  # parts of one object; an anatomical atlas of an abdomen has about 30
MAX_NAME = 60  # characters


class PartSurface(NamedTuple):
    """The surface of one part.

    Args:
        name: Name of the part; empty if the object has no parts.
        x: Vertices, shape (n, 3).
        faces: Triangles, shape (m, 3).
    """

    name: str
    x: Floats
    faces: Ints


@dataclass(frozen=True, eq=False)
class Parts:
    """The parts of an object.

    Args:
        names: Names of the parts, without repetition.
        of: Part of each tetrahedron, as an index into `names`, shape (m,).

    Raises:
        BodyError: There is no part, a name occurs twice, or an index is out of range.
    """

    names: tuple[str, ...]
    of: Ints

    def __post_init__(self) -> None:
        if not self.names or len(set(self.names)) != len(self.names):
            raise BodyError(f"the parts of an object need names of their own: {self.names}")
        if len(self.of) and not 0 <= int(self.of.min()) <= int(self.of.max()) < len(self.names):
            raise BodyError(f"a tetrahedron names part {self.of.max()} of {len(self.names)}")

    def volumes(self, tets: TetMesh) -> Floats:
        """Volume of each part, shape (parts,) [m^3]."""
        each = volumes(tets.vertices, tets.tets)
        return np.asarray(np.bincount(self.of, each, len(self.names)), dtype=np.float64)

    def of_elements(self, elements: Ints) -> Parts:
        """Parts of new elements, given the index of the tetrahedron that each comes from, (k,)."""
        return Parts(self.names, self.of[elements])


def joined(surfaces: Sequence[PartSurface]) -> tuple[Floats, Ints]:
    """Join all surfaces into one: vertices, shape (n, 3), and triangles, shape (m, 3)."""
    starts = np.cumsum([0, *(len(surface.x) for surface in surfaces)])
    faces = [surface.faces + start for surface, start in zip(surfaces, starts, strict=False)]
    return np.concatenate([surface.x for surface in surfaces]), np.concatenate(faces)


def distinct(names: Sequence[str]) -> tuple[str, ...]:
    """Make names printable and distinct for a command line: a second `lung` becomes `lung.2`."""
    taken: dict[str, int] = {}
    found: list[str] = []
    for name in names:
        printable = "".join(c if c.isprintable() else " " for c in name)
        plain = " ".join(printable.split())[:MAX_NAME] or "part"
        taken[plain] = count = taken.get(plain, 0) + 1
        candidate = plain if count == 1 else f"{plain}.{count}"
        while candidate in found:
            taken[plain] = count = count + 1
            candidate = f"{plain}.{count}"
        found.append(candidate)
    return tuple(found)


MAX_VOLUME_LOSS = 0.2  # share of the volume that tetrahedra may miss
# Largest distance from a surface to that of its tetrahedra, beyond the envelope of the filling, as
# a share of the diagonal. Simplifying takes up to a hundredth. The volume alone proves little: of a
# leaflet 1 mm thick fTetWild made a lump of 25 tetrahedra with 98 % of its volume.
MAX_AWAY = 0.03


class VolumeLostError(BodyError):
    """The tetrahedra miss much of the volume inside a surface, of the whole object or of a part.

    Args:
        problem: The fault, as the beginning of a sentence.
        advice: The rest of the sentence: the reason and the remedy.
        part: Name of the part; empty for the whole object.
        path: Path of the file, if it is known.

    Attributes:
        problem: The fault, as the beginning of a sentence.
        part: Name of the part; empty for the whole object.
    """

    def __init__(self, problem: str, advice: str = "", part: str = "", path: object = None) -> None:
        super().__init__(f"{'' if path is None else f'{path}: '}{problem}{advice}")
        self.problem = problem
        self.part = part
        self._advice = advice

    def of(self, path: object) -> VolumeLostError:
        """Copy of this error whose text begins with the path of the file."""
        return VolumeLostError(self.problem, self._advice, self.part, path)
