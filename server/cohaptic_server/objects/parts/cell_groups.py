"""Groups of cells in a volume mesh: physical groups of Gmsh, or cell data that counts materials."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from cohaptic.errors import BodyError
from cohaptic_server.objects.parts.parts import MAX_PARTS, Parts, distinct

# Names under which programs store the part of a cell, in small letters, the first one found counts.
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
    """The groups of the cells of some kinds, in the order of the blocks; None if there are none.

    Args:
        path: The file, for an error.
        mesh: A `meshio.Mesh`.
        kinds: Types of cells that count.

    Raises:
        BodyError: There are too many groups, or they are not whole numbers.
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
    """Names of the physical groups of volumes, by their number."""
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
