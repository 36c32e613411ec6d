"""The one gate behind every reader: what was read has corners that are there, finite and apart.

A reader knows its format and nothing of solids; a damaged file may give it any number. Behind this
gate no coordinate is so large or so near to others that later arithmetic fails, and points that no
cell uses have no part in any size. What needs more than one cell, such as holes, crossings and
overlaps, is examined later (`surface/checks.py`, `volume_checks.py`).
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from cohaptic.errors import BodyError
from cohaptic_server.mesh.tetrahedra import flat
from cohaptic_server.numeric import Floats, Ints, Mask, cross

# Longest side of an object, in units of its file: a number of `--scale` brings it to a hand's size.
SMALLEST, LARGEST = 1e-9, 1e8
# Largest coordinate over the longest side, for doubles, which then resolve 1e-9 of that side, and
# for numbers in single precision, which resolve 6e-4 of it. Maps place objects some million metres
# away.
FARTHEST, FARTHEST_SINGLE = 1e7, 1e4
# Least area of the largest triangle over the square of the longest side. Corners nearer than 1e-8
# of that side are one point (`surface/surface_file.py`), and leave areas of up to 1.5e-8.
_LEAST_AREA = 2e-8
_ANEW = "Export it anew"


def checked_cells(path: Path, x: Floats, cells: Ints) -> tuple[Floats, Ints]:
    """Check triangles or tetrahedra and their corners, and drop points that none of them uses.

    Args:
        path: The file, for an error.
        x: Vertices, shape (n, 3), in units of the file.
        cells: Vertices of each triangle, shape (m, 3), or tetrahedron, shape (m, 4), with m > 0.

    Returns:
        Vertices that are used, in the same order, and the cells with the new numbers.

    Raises:
        BodyError: A cell names a vertex that is not there; a coordinate is not finite; the object
            is too small, too large or too far from the origin for its numbers; no triangle has an
            area; or a tetrahedron has no volume.
    """
    kind = "triangle" if cells.shape[1] == 3 else "tetrahedron"
    if cells.min() < 0 or cells.max() >= len(x):
        wrong = cells.min() if cells.min() < 0 else cells.max()
        raise BodyError(f"{path}: a {kind} names vertex {wrong} of {len(x):,}. {_ANEW}")
    used, renumbered = np.unique(cells, return_inverse=True)
    x, cells = x[used], np.asarray(renumbered.reshape(cells.shape), dtype=np.int64)
    bad = int((~np.isfinite(x).all(axis=1)).sum())
    if bad:
        raise BodyError(
            f"{path}: {bad:,} of {len(x):,} vertices have a coordinate that is not a number."
            f" {_ANEW}"
        )
    _check_place(path, x, kind)
    without = _without_area(x, cells) if kind == "triangle" else flat(x, cells)
    if kind == "triangle" and without.all():
        raise BodyError(
            f"{path}: there is no surface in it: each of its {len(cells):,} triangles has two"
            " corners at one place, or all on one line, as far as the size of the whole lets them"
            f" be told apart. {_ANEW}"
        )
    if kind == "tetrahedron" and without.any():
        raise BodyError(
            f"{path}: {without.sum():,} of {len(cells):,} tetrahedra are flat. Mesh the object anew"
        )
    return x, cells


def _check_place(path: Path, x: Floats, kind: str) -> None:
    """Refuse vertices whose size or distance from the origin no sensible object has."""
    with np.errstate(over="ignore"):  # an infinite size is refused
        size, away = float(np.ptp(x, axis=0).max()), float(np.abs(x).max())
    if not size:
        raise BodyError(
            f"{path}: all its {len(x):,} vertices lie at one place, so that each {kind} has"
            f" collapsed. {_ANEW}"
        )
    if not SMALLEST <= size <= LARGEST:
        raise BodyError(
            f"{path}: its longest side is {size:.3g} units long; from {SMALLEST:g} to {LARGEST:g}"
            " can be brought to metres by --scale. Is a coordinate damaged? Export it anew"
        )
    single = away > FARTHEST_SINGLE * size and bool((x == x.astype(np.float32)).all())
    if away > (FARTHEST_SINGLE if single else FARTHEST) * size:
        numbers, way = (
            ("numbers in single precision", ", or save it as text") if single else ("numbers", "")
        )
        raise BodyError(
            f"{path}: it lies {away:.3g} units from the origin of its coordinates and is"
            f" {size:.3g} long: its {numbers} do not tell its points apart there. Move it to the"
            f" origin{way}"
        )


def _without_area(x: Floats, faces: Ints) -> Mask:
    """Whether each triangle has practically no area, for the size of all, shape (m,)."""
    a, b, c = (x[faces[:, k]] for k in range(3))
    area = 0.5 * np.linalg.norm(cross(b - a, c - a), axis=1)
    return np.asarray(area < _LEAST_AREA * float(np.ptp(x, axis=0).max()) ** 2, dtype=np.bool_)
