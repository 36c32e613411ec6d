"""Reads the tetrahedra of a volume mesh and their groups.

Each reader counts the cells that it cannot give as tetrahedra: those that have a volume are refused
here, since the object would lack them. The groups of cells are physical groups of Gmsh, or cell
data that number the materials.
"""

from __future__ import annotations

from collections.abc import Callable, Container, Mapping
from pathlib import Path
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from cohaptic.errors import BodyError
from cohaptic_server.numeric import Floats, Ints
from cohaptic_server.objects.checked_cells import checked_cells
from cohaptic_server.objects.first_bytes import START
from cohaptic_server.objects.fluent_file import read_fluent
from cohaptic_server.objects.gmsh_file import is_gmsh, read_gmsh
from cohaptic_server.objects.memory_limit import damaged, reading_limited, say_once
from cohaptic_server.objects.parts.parts import MAX_PARTS, Parts, distinct
from cohaptic_server.objects.volume_cells import VolumeCells, whole
from cohaptic_server.objects.volume_checks import check_conforming, largest_alone, mended
from cohaptic_server.objects.vtk_cells import Grid, tetrahedra_of
from cohaptic_server.objects.vtk_file import read_vtk
from cohaptic_server.objects.vtu_file import read_vtu

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


def groups_of(path: Path, data: Mapping[str, Floats], at: Ints) -> Parts | None:
    """Group of each of some cells; None without groups.

    Args:
        path: The file, for an error.
        data: Values of all cells by the name of their array.
        at: Indices of the cells to take, shape (m,).

    Raises:
        BodyError: There are too many groups, or their numbers are not whole or exceed 2^53.
    """
    by_name = {name.lower(): name for name in data}
    known = next((by_name[one] for one in _KNOWN if one in by_name), None)
    if known is None:
        return None
    if data[known].ndim > 1:
        raise BodyError(
            f"{path}: its cell data {known!r} should number the parts, and has"
            f" {data[known].shape[1]} numbers for a cell"
        )
    return _parts(path, known, data[known][at], {})


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
    try:
        with reading_limited(path):
            x, found, parts = _READERS[path.suffix.lower()](path)
    except BodyError:
        raise
    # Readers raise errors of many kinds, and meshio SystemExit if none accepts the file.
    except (Exception, SystemExit) as error:
        raise BodyError(f"{path}: this is no mesh that can be read: {damaged(error)}") from error
    tets, solids = found.tets, +found.solids
    if solids:
        beside = "beside tetrahedra it has cells that would be lost" if len(tets) else "it has"
        listed = ", ".join(f"{n:,} of {kind}" for kind, n in sorted(solids.items()))
        raise BodyError(
            f"{path}: {beside}: {listed}. Split them into tetrahedra first: in"
            " ParaView by Filters, Tetrahedralize, and save that as .vtu; in Gmsh mesh it anew"
            " without Recombine"
        )
    if not len(tets):
        kinds = ", ".join(sorted(+found.flat)) or "-"
        raise BodyError(
            f"{path}: there is no tetrahedron in it, only: {kinds}. Mesh its volume first (in Gmsh:"
            " Mesh, 3D), or save it as STL"
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


# Vertices, cells, and parts of the tetrahedra.
_Read: TypeAlias = tuple[Floats, VolumeCells, Parts | None]


def _of_grid(read: Callable[[Path, Container[str]], Grid]) -> Callable[[Path], _Read]:
    """A reader of volumes, of a reader of grids."""

    def read_grid(path: Path) -> _Read:
        grid = read(path, (*_KNOWN, _MARKS))
        found = _shown(path, tetrahedra_of(grid), grid)
        return grid.x, found, groups_of(path, grid.data, found.at)

    return read_grid


# VTK's array of marks, and those of cells that no program shows: refined and hidden ones. Marks of
# cells that another piece has, too, are of no use here, since each tetrahedron counts once.
_MARKS, _HIDDEN = "vtkghosttype", 8 | 32


def _shown(path: Path, found: VolumeCells, grid: Grid) -> VolumeCells:
    """Tetrahedra that are not marked as hidden; those that are, are left out and said."""
    for name, marks in grid.data.items():
        if name.lower() == _MARKS and marks.ndim == 1:
            shown = (whole(marks[found.at]) & _HIDDEN) == 0
            if not shown.all():
                count = f"{(~shown).sum():,} of {len(shown):,} tetrahedra"
                say_once(path, f"{count} are marked as hidden ({name}), and are left out")
            found = found._replace(tets=found.tets[shown], at=found.at[shown])
    return found


def _msh(path: Path) -> _Read:
    """A `.msh` of Gmsh or of Fluent."""
    with path.open("rb") as file:
        start = file.read(START).lstrip()
    if start.startswith(b"("):
        return (*read_fluent(path), None)
    if not is_gmsh(start):
        raise BodyError(
            f"{path}: this is no mesh that can be read: it does not begin as Gmsh's files do, with"
            " $MeshFormat. Export it from there"
        )
    mesh = read_gmsh(path)
    names, grouped = dict(mesh.names), mesh.groups != 0
    if grouped.any() and not grouped.all():
        names[0] = REST if REST not in names.values() else f"{REST} without a group"
    parts = _parts(path, "gmsh:physical", mesh.groups, names) if grouped.any() else None
    return mesh.x, mesh.cells, parts


_READERS = {".msh": _msh, ".vtk": _of_grid(read_vtk), ".vtu": _of_grid(read_vtu)}
