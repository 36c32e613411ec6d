"""Small solids of known volume, from which the valid files are written.

All of them are about 0.1 m long, so that no reader takes the metre for another unit.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import permutations

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]

SIZE = 0.1  # m; longest side of each shape
SIDE = 8  # voxels along a side of a label map
VOXEL = SIZE / 10  # m; side of a voxel


@dataclass(frozen=True, eq=False)
class Shape:
    """A closed surface, with outward triangles.

    Args:
        name: Name of the shape.
        x: Vertices, shape (n, 3) [m].
        faces: Triangles, shape (m, 3).
    """

    name: str
    x: Floats
    faces: Ints

    @property
    def volume(self) -> float:
        """Enclosed volume [m^3]: the sum of the tetrahedra from the origin to each triangle."""
        return float(np.linalg.det(self.x[self.faces]).sum()) / 6.0


EDGES = ((0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3))  # in the order of VTK


@dataclass(frozen=True, eq=False)
class Block:
    """A box of cells, each cut into six tetrahedra of positive volume.

    Args:
        x: Vertices, shape (n, 3) [m].
        tets: Vertices of each tetrahedron, shape (m, 4).
        groups: A number, 1 or 7, for each tetrahedron, shape (m,).
    """

    x: Floats
    tets: Ints
    groups: Ints

    @property
    def volume(self) -> float:
        """Volume [m^3]."""
        return float((self.x.max(axis=0) - self.x.min(axis=0)).prod())

    def quadratic(self) -> tuple[Floats, Ints]:
        """Points and ten-node tetrahedra, each with middles of its own, in the order of VTK."""
        ends = self.tets[:, np.array(EDGES)]
        middles = self.x[ends].mean(axis=2).reshape(-1, 3)
        numbers = len(self.x) + np.arange(len(middles)).reshape(-1, len(EDGES))
        return np.concatenate([self.x, middles]), np.concatenate([self.tets, numbers], axis=1)


def tetrahedron() -> Shape:
    """Four triangles, the fewest that enclose a volume."""
    x = SIZE * np.array([(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)])
    return Shape("tetrahedron", x, np.array([(0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)]))


def ball(rounds: int = 2) -> Shape:
    """An octahedron whose triangles are cut into four, as often as `rounds` says."""
    x = [
        np.array(p, np.float64)
        for p in ((1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1))
    ]
    faces = [(0, 2, 4), (2, 1, 4), (1, 3, 4), (3, 0, 4), (2, 0, 5), (1, 2, 5), (3, 1, 5), (0, 3, 5)]
    for _ in range(rounds):
        between: dict[frozenset[int], int] = {}

        def middle(a: int, b: int, known: dict[frozenset[int], int] = between) -> int:
            if (key := frozenset((a, b))) not in known:
                known[key] = len(x)
                x.append((x[a] + x[b]) / np.linalg.norm(x[a] + x[b]))
            return known[key]

        cut: list[tuple[int, int, int]] = []
        for a, b, c in faces:
            ab, bc, ca = middle(a, b), middle(b, c), middle(c, a)
            cut += [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
        faces = cut
    return Shape("ball", 0.5 * SIZE * np.array(x), np.array(faces))


def torus(around: int = 12, across: int = 8) -> Shape:
    """A ring, whose hole makes it another surface than a ball."""
    u = np.linspace(0.0, 2.0 * np.pi, around, endpoint=False)[:, None]
    v = np.linspace(0.0, 2.0 * np.pi, across, endpoint=False)[None, :]
    wide = 0.7 + 0.3 * np.cos(v)
    x = np.stack([wide * np.cos(u), wide * np.sin(u), 0.3 * np.sin(v) + 0.0 * u], axis=-1)
    i, j = (k.ravel() for k in np.indices((around, across)))
    a, b = i * across + j, (i + 1) % around * across + j
    c, d = i * across + (j + 1) % across, (i + 1) % around * across + (j + 1) % across
    faces = np.concatenate([np.stack([a, b, d], axis=1), np.stack([a, d, c], axis=1)])
    return Shape("torus", 0.5 * SIZE * x.reshape(-1, 3), faces)


def block(cells: tuple[int, int, int] = (3, 2, 2)) -> Block:
    """A box whose cells are cut along their diagonals (Kuhn), in two groups from end to end."""
    counts = np.array(cells)
    grid = np.stack(np.meshgrid(*(np.arange(n + 1) for n in cells), indexing="ij"), axis=-1)
    x = SIZE / counts.max() * grid.reshape(-1, 3)
    strides = np.array([(cells[1] + 1) * (cells[2] + 1), cells[2] + 1, 1])
    tets: list[list[int]] = []
    for cell in np.ndindex(*cells):
        for order in permutations(range(3)):
            steps = [np.array(cell)]
            for axis in order:
                steps.append(steps[-1] + np.eye(3, dtype=np.int64)[axis])
            corners = [int(step @ strides) for step in steps]
            even = order in ((0, 1, 2), (1, 2, 0), (2, 0, 1))
            tets.append(corners if even else [corners[k] for k in (0, 2, 1, 3)])
    groups = np.where(np.arange(len(tets)) < len(tets) // 2, 1, 7)
    return Block(x, np.array(tets), groups)


def voxels(labels: int = 1, side: int = SIDE) -> npt.NDArray[np.uint8]:
    """A ball in a cube of voxels, shape (side, side, side); its upper half has label 2 if asked."""
    x, y, z = np.indices((side, side, side)) - 0.5 * (side - 1)
    found = (x**2 + y**2 + z**2 <= (0.4 * side) ** 2).astype(np.uint8)
    if labels > 1:
        found[(found > 0) & (z > 0)] = 2
    return np.asarray(found, dtype=np.uint8)
