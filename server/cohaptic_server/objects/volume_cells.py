"""What a reader of volume meshes gives: the tetrahedra, and the count of everything else."""

from __future__ import annotations

from collections import Counter
from typing import Any, NamedTuple

import numpy as np

from cohaptic_server.numeric import Ints

_LARGEST = 2**53  # up to which doubles tell whole numbers apart


class VolumeCells(NamedTuple):
    """The tetrahedra of a mesh, and what else there is in it.

    Args:
        tets: Corners of each tetrahedron, shape (m, 4).
        at: Index of each among all cells, shape (m,).
        solids: Number of other cells with a volume, by their kind.
        flat: Number of cells without a volume, by their kind.
    """

    tets: Ints
    at: Ints
    solids: Counter[str]
    flat: Counter[str]


def whole(numbers: Any) -> Ints:
    """Counts, tags and indices as whole numbers; those of a text are read as doubles.

    Raises:
        ValueError: One is not whole, or beyond 2^53.
    """
    values = np.asarray(numbers)
    if values.dtype.kind == "f" and not (np.floor(values) == values).all():
        raise ValueError("a count or a tag is no whole number")
    if len(values) and not -_LARGEST < values.min() <= values.max() < _LARGEST:
        raise ValueError("a count or a tag is beyond 2^53")
    return np.asarray(values, dtype=np.int64)
