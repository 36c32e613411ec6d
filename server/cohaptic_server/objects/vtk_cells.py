"""The cells of a grid of VTK: tetrahedra are read, faces may be left out, all else is counted.

What may be left out is listed here, and not what may not: a kind of cell that nobody has heard of
is then named in an error, in place of being lost.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from cohaptic_server.numeric import Floats, Ints
from cohaptic_server.objects.volume_cells import VolumeCells

# Numbers and names are those of vtkCellType.h. A tetrahedron's first four nodes are its corners.
_TETRAHEDRA = {10: 4, 24: 10}  # number of nodes
_ANY_ORDER = (64, 71, 78)  # tetrahedra of higher order, as polynomials, of Lagrange and of Bezier
_CORNERS = 4
# Cells without a volume, which a mesh has beside its tetrahedra for its surface or its loads.
_FLAT = {
    0: "empty cell", 1: "vertex", 2: "vertices", 3: "line", 4: "polyline", 5: "triangle",
    6: "triangle strip", 7: "polygon", 8: "pixel", 9: "quad", 21: "quadratic line",
    22: "quadratic triangle", 23: "quadratic quad", 28: "biquadratic quad",
    30: "quadratic linear quad", 34: "biquadratic triangle", 35: "cubic line",
    36: "quadratic polygon", 51: "parametric curve", 52: "parametric surface",
    53: "parametric triangle", 54: "parametric quad", 60: "line of higher order",
    61: "triangle of higher order", 62: "quad of higher order", 63: "polygon of higher order",
    68: "Lagrange line", 69: "Lagrange triangle", 70: "Lagrange quad", 75: "Bezier line",
    76: "Bezier triangle", 77: "Bezier quad",
}  # fmt: skip
# Names of the best known solids; another one is named by its number.
_SOLIDS = {
    11: "voxel", 12: "hexahedron", 13: "wedge", 14: "pyramid", 15: "pentagonal prism",
    16: "hexagonal prism", 25: "quadratic hexahedron", 26: "quadratic wedge",
    27: "quadratic pyramid", 29: "triquadratic hexahedron", 37: "triquadratic pyramid",
    41: "convex point set", 42: "polyhedron", 72: "Lagrange hexahedron", 73: "Lagrange wedge",
    74: "Lagrange pyramid", 79: "Bezier hexahedron", 80: "Bezier wedge", 81: "Bezier pyramid",
}  # fmt: skip


class Grid(NamedTuple):
    """Points and cells as a file of VTK has them.

    Args:
        x: Points, shape (n, 3).
        corners: Points of all cells, one cell after another, shape (k,).
        ends: End of each cell in `corners`, shape (m,).
        types: VTK's type of each cell, shape (m,).
        data: Values of the cells by the name of their array, each of shape (m,) or (m, components).
    """

    x: Floats
    corners: Ints
    ends: Ints
    types: Ints
    data: Mapping[str, Floats]


def tetrahedra_of(grid: Grid) -> VolumeCells:
    """Find the tetrahedra of a grid, in its order, and count all other cells.

    Raises:
        ValueError: The arrays do not fit together, or a tetrahedron has another number of nodes.
    """
    if len(grid.ends) != len(grid.types):
        raise ValueError(f"{len(grid.ends):,} cells have {len(grid.types):,} types")
    nodes = np.diff(grid.ends, prepend=0)
    if (nodes < 0).any() or int(nodes.sum()) != len(grid.corners):
        raise ValueError(f"its cells do not end where their {len(grid.corners):,} points do")
    solids, flat = Counter[str](), Counter[str]()
    is_tetrahedron = np.zeros(len(grid.types), dtype=np.bool_)
    kinds, counts = np.unique(grid.types, return_counts=True)
    for kind, count in zip(kinds.tolist(), counts.tolist(), strict=True):
        of_kind = grid.types == kind
        if kind in _TETRAHEDRA or kind in _ANY_ORDER:
            some = nodes[of_kind]
            wrong = some != _TETRAHEDRA[kind] if kind in _TETRAHEDRA else some < _CORNERS
            if wrong.any():
                raise ValueError(f"a tetrahedron of VTK's type {kind} has {some[wrong][0]} nodes")
            is_tetrahedron |= of_kind
        elif kind in _FLAT:
            flat[_FLAT[kind]] += count
        else:
            solids[_SOLIDS.get(kind, f"VTK's type {kind}")] += count
    at = np.flatnonzero(is_tetrahedron)
    first = (grid.ends - nodes)[at]
    tets = grid.corners[first[:, None] + np.arange(_CORNERS)]
    return VolumeCells(tets.reshape(-1, _CORNERS), at, solids, flat)
