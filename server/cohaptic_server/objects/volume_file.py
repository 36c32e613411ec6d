"""Reads the tetrahedra of a volume mesh and their groups, through meshio.

The groups of cells are physical groups of Gmsh, or cell data that number the materials.
"""

from __future__ import annotations

import contextlib
import io
import re
from collections import Counter
from pathlib import Path
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from cohaptic.errors import BodyError
from cohaptic_server.numeric import Floats, Ints
from cohaptic_server.objects.gate import checked_cells
from cohaptic_server.objects.gmsh_file import is_gmsh, read_gmsh
from cohaptic_server.objects.memory_limit import damaged, reading_limited
from cohaptic_server.objects.parts.parts import MAX_PARTS, Parts, distinct
from cohaptic_server.objects.volume_checks import check_conforming, largest_alone, mended

# Names under which programs store the part of a cell, in lower case; the first one found counts.
_KNOWN = (
    "gmsh:physical",
    "medit:ref",
    "cell_tags",
    "material",
    "materialids",
    "materialid",
    "material_id",
    "mat",
    "region",
    "regionid",
    "part",
    "partid",
    "group",
    "label",
    "labels",
)


def groups_of(path: Path, mesh: Any, kinds: tuple[str, ...]) -> Parts | None:
    """Group of each cell of the given types, in the order of the file; None without groups.

    Args:
        path: The file, for an error.
        mesh: A `meshio.Mesh`.
        kinds: Types of cells to take, as meshio names them.

    Raises:
        BodyError: There are too many groups, or their numbers are not whole or exceed 2^53.
    """
    chosen = [k for k, cells in enumerate(mesh.cells) if cells.type in kinds]
    by_name = {str(name).lower(): (str(name), data) for name, data in mesh.cell_data.items()}
    for known in _KNOWN:
        if known in by_name:
            name, data = by_name[known]
            blocks = [np.asarray(data[k]).reshape(-1) for k in chosen]
            return _parts(path, name, np.concatenate(blocks), _names(mesh))
    return None


def _names(mesh: Any) -> dict[int, str]:
    """Names of the physical groups of volumes, by group number."""
    found: dict[int, str] = {}
    for name, value in dict(mesh.field_data).items():
        pair = np.asarray(value).reshape(-1)
        if len(pair) >= 2 and int(pair[1]) == 3:
            found[int(pair[0])] = str(name)
    return found


def _parts(path: Path, name: str, values: Any, names: dict[int, str]) -> Parts | None:
    numbers = np.asarray(values, dtype=np.float64)
    if not np.isfinite(numbers).all() or (numbers != np.round(numbers)).any():
        raise BodyError(f"{path}: its cell data {name!r} should number the parts, in whole numbers")
    if np.abs(numbers).max(initial=0.0) > 2**53:
        raise BodyError(f"{path}: its cell data {name!r} has numbers beyond 2^53")
    tags, of = np.unique(numbers.astype(np.int64), return_inverse=True)
    if len(tags) > MAX_PARTS:
        raise BodyError(
            f"{path}: its cell data {name!r} has {len(tags):,} different values; parts with"
            f" materials of their own may be {MAX_PARTS}"
        )
    if len(tags) < 2 and not names:
        return None
    said = distinct([names.get(int(tag), str(int(tag))) for tag in tags])
    return Parts(said, np.asarray(of, dtype=np.int64).reshape(-1))


_START = 4096  # bytes at the start of a file that show its format
_TETRAHEDRA = ("tetra", "tetra10")
REST = "rest"  # name of the part that has the elements of no group


class VolumeMesh(NamedTuple):
    """Tetrahedra of a file.

    Args:
        x: Vertices, shape (n, 3) in units of the file.
        tets: Vertices of each tetrahedron, shape (m, 4).
        parts: Parts of the tetrahedra; None if the file does not group them.
    """

    x: Floats
    tets: Ints
    parts: Parts | None


def read_volume(path: Path, *, largest: bool = False) -> VolumeMesh:
    """Read vertices and tetrahedra, and the groups of the tetrahedra.

    Only the corners of ten-node tetrahedra are kept; a solid adds its own midside nodes.

    Args:
        path: A file of one of `VOLUMES`.
        largest: Whether to leave out small pieces beside the largest.

    Raises:
        BodyError: The file cannot be read, has no or invalid tetrahedra, or has other solid cells.
    """
    with path.open("rb") as file:
        start = file.read(_START)
    gmsh = path.suffix.lower() == ".msh" and is_gmsh(start)
    try:
        x, tets, parts, counts = _of_gmsh(path) if gmsh else _by_meshio(path)
    except BodyError:
        raise
    # Readers raise errors of many kinds, and meshio SystemExit if none accepts the file.
    except (Exception, SystemExit) as error:
        words = _instead(path) or f": {damaged(error)}"
        raise BodyError(f"{path}: this is no mesh that can be read{words}") from error
    others = [f"{n:,} of {kind}" for kind, n in sorted(counts.items()) if _is_solid(kind) and n]
    if not len(tets):
        kinds = ", ".join(sorted(counts)) or "-"
        raise BodyError(
            f"{path}: there is no tetrahedron in it, only: {kinds}. Mesh its volume first (in Gmsh:"
            " Mesh, 3D), or save it as STL"
        )
    if others:
        raise BodyError(
            f"{path}: beside tetrahedra it has cells that would be lost: {', '.join(others)}."
            " Split them into tetrahedra first"
        )
    x, tets = checked_cells(path, x, tets)
    x, tets, taken = mended(path, x, tets)
    if largest:
        kept = largest_alone(path, x, tets)
        x, tets = checked_cells(path, x, tets[kept])
        taken = taken[kept]
    check_conforming(path, x, tets)
    return VolumeMesh(x, tets, None if parts is None else _of_those(parts, taken))


def _of_those(parts: Parts, taken: Ints) -> Parts:
    """Parts of some of the tetrahedra; a part that has none of them is gone."""
    left, of = np.unique(parts.of[taken], return_inverse=True)
    names = tuple(parts.names[int(k)] for k in left)
    return Parts(names, np.asarray(of, dtype=np.int64).reshape(-1))


_Read: TypeAlias = tuple[Floats, Ints, Parts | None, Counter[str]]


def _of_gmsh(path: Path) -> _Read:
    """Vertices, tetrahedra, parts, and the number of cells by kind."""
    with reading_limited(path):
        mesh = read_gmsh(path)
    names, grouped = dict(mesh.names), mesh.groups != 0
    if grouped.any() and not grouped.all():
        names[0] = REST if REST not in names.values() else f"{REST} without a group"
    parts = _parts(path, "gmsh:physical", mesh.groups, names) if grouped.any() else None
    return mesh.x, mesh.tets, parts, mesh.others


def _by_meshio(path: Path) -> _Read:
    """Vertices, tetrahedra, parts, and the number of cells by kind."""
    try:
        import meshio

        read: Any = meshio.read  # pyright: ignore[reportUnknownMemberType, reportUnknownVariableType]
    except ImportError as error:
        raise BodyError(
            f"{path}: reading {path.suffix} needs meshio; install it with:"
            " pip install 'cohaptic[objects]'"
        ) from error
    # meshio prints messages, which must not mix with the server's output that scripts read.
    silent = io.StringIO()
    with (
        reading_limited(path),
        contextlib.redirect_stdout(silent),
        contextlib.redirect_stderr(silent),
    ):
        loaded: Any = _loaded(path, read)
    blocks = [
        np.array(cells.data, dtype=np.int64)[:, :4]
        for cells in loaded.cells
        if cells.type in _TETRAHEDRA
    ]
    counts = Counter[str]()
    for cells in loaded.cells:
        counts[str(cells.type)] += len(cells.data)
    x = np.array(loaded.points, dtype=np.float64)
    tets = np.concatenate([np.zeros((0, 4), dtype=np.int64), *blocks])
    return x, tets, groups_of(path, loaded, _TETRAHEDRA) if blocks else None, counts


def _loaded(path: Path, read: Any) -> Any:
    if path.suffix.lower() != ".msh":
        return read(path)
    with _Ending(io.FileIO(path)) as file:
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


def _instead(path: Path) -> str:
    """Words on what an unreadable file is, and what to do; empty if its start does not show it.

    Files of other programs have the same suffixes: surfaces from VTK, meshes from MuJoCo and
    Fluent, and grids with fields that meshio does not know.
    """
    with path.open("rb") as file:
        start = file.read(_START)
    if path.suffix.lower() == ".msh" and not start.lstrip().startswith((b"$", b"(")):
        return ": it does not begin as Gmsh's files do, with $MeshFormat. Export it from there"
    kind = re.search(rb"^DATASET\s+(\w+)", start, re.M | re.I)
    if kind is None:
        return ""
    name = kind[1][:40].decode().upper()
    if name == "POLYDATA":
        return ": it has a surface (POLYDATA). Save that as STL or PLY"
    if name == "UNSTRUCTURED_GRID":
        return ", though it says that it is one. Save it as .vtu"
    return f": it is a grid of points ({name}). Save tetrahedra as .vtu"


def _is_solid(kind: str) -> bool:
    """Whether cells of a kind, as meshio names it, fill a volume but are not tetrahedra."""
    return kind.startswith(("hexa", "wedge", "pyramid", "polyhedron", "VTK_LAGRANGE_HEX"))
