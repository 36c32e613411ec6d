"""Reads the tetrahedra of a mesh of Fluent, through meshio.

meshio skips sections that it does not know without a word. The headers of the sections of cells
say how many there are of each kind, and are counted here for themselves.
"""

from __future__ import annotations

import io
import re
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np

from cohaptic.errors import BodyError
from cohaptic_server.numeric import Floats
from cohaptic_server.objects.memory_limit import silenced
from cohaptic_server.objects.volume_cells import VolumeCells

# (12 (zone first last type element-type)), numbers to the base 16; zone 0 declares the total.
_CELLS = re.compile(rb"(?:^|\))\s*\(\s*(?:20|30)?12\s*\(([0-9a-fA-F \t-]{1,200})\)", re.M)
_KINDS = {0: "mixed", 1: "triangle", 2: "tetrahedron", 3: "quad", 4: "hexahedron", 5: "pyramid",
          6: "wedge", 7: "polyhedron"}  # fmt: skip
_FLAT = ("triangle", "quad")


def read_fluent(path: Path) -> tuple[Floats, VolumeCells]:
    """Vertices, shape (n, 3), and the cells of a file that begins with a bracket.

    Raises:
        BodyError: meshio is missing, or the cells cannot be read.
        Exception: The file is damaged; errors of many kinds.
    """
    total, counts = _declared(path)
    there = sum(counts.values())
    if total is not None and total != there:
        raise BodyError(
            f"{path}: its header says {total:,} cells, and its sections have {there:,}. Export it"
            " anew, or open it in ParaView and save its tetrahedra as .vtu"
        )
    solids = Counter({k: n for k, n in counts.items() if k not in (*_FLAT, "tetrahedron") and n})
    none = np.zeros(0, dtype=np.int64)
    if solids:
        return np.zeros((0, 3)), VolumeCells(none.reshape(0, 4), none, solids, Counter())
    loaded = _loaded(path)
    tets = [np.array(one.data, dtype=np.int64) for one in loaded.cells if one.type == "tetra"]
    flat = Counter[str]()
    for one in loaded.cells:
        if one.type != "tetra":
            flat[str(one.type)] += len(one.data)
    corners = np.concatenate([none.reshape(0, 4), *tets])
    if len(corners) != counts["tetrahedron"]:
        raise BodyError(
            f"{path}: it has {counts['tetrahedron']:,} tetrahedra, as faces with a cell on each"
            f" side, of which {len(corners):,} can be read. Open it in ParaView, and save them as"
            " .vtu"
        )
    x = np.array(loaded.points, dtype=np.float64)
    return x, VolumeCells(corners, np.arange(len(corners)), Counter(), flat)


def _declared(path: Path) -> tuple[int | None, Counter[str]]:
    """Number of all cells, if the file declares it, and of those of each kind."""
    total: int | None = None
    counts = Counter[str]()
    for match in _CELLS.finditer(path.read_bytes()):
        numbers = [int(word, 16) for word in match[1].split()]
        if len(numbers) < 3 or numbers[2] < numbers[1] - 1:
            raise ValueError("a section of cells does not say from which cell to which it goes")
        zone, first, last, *more = numbers
        if zone == 0:
            if total is not None:
                raise ValueError("it declares the number of its cells twice")
            total = last - first + 1
        else:
            kind = more[1] if len(more) > 1 else 0
            counts[_KINDS.get(kind, f"Fluent's type {kind}")] += last - first + 1
    return total, counts


def _loaded(path: Path) -> Any:
    try:
        import meshio

        read: Any = meshio.read  # pyright: ignore[reportUnknownMemberType, reportUnknownVariableType]
    except ImportError as error:
        raise BodyError(
            f"{path}: reading a mesh of Fluent needs meshio; install it with:"
            " pip install 'cohaptic[objects]'"
        ) from error
    with silenced("meshio"), _Ending(io.FileIO(path)) as file:
        return read(file, "ansys")


class _Ending(io.BufferedReader):
    """A file whose second read at its end raises EOFError: meshio would read there for ever."""

    _ended = False

    def read(self, size: int | None = -1, /) -> bytes:
        """Read up to `size` bytes; raises EOFError if an earlier call has returned nothing."""
        return self._next(super().read(size))

    def readline(self, size: int | None = -1, /) -> bytes:
        """Read a line; raises EOFError if an earlier call has returned nothing."""
        return self._next(super().readline(size))

    def _next(self, data: bytes) -> bytes:
        if self._ended:
            raise EOFError("it ends too early")
        self._ended = not data
        return data
