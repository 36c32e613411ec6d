"""Inner loops of `world/patch_geometry.py`, which pack vertices as whole numbers of units."""

from __future__ import annotations

import numpy as np

from cohaptic_server.numeric import Floats, Ints

FIELDS = 5  # values per vertex: its number, three of displacement, compliance
# Adding and then subtracting this number, 1.5 times 2^52, rounds a double of IEEE 754 as `round`
# does, halves to even.
_TO_WHOLE = 6755399441055744.0
_HUGE = 1e300  # beyond any value that is one; infinity and NaN are not below it


def largest(
    starts: Ints,
    displacement: Floats,
    c_ii: Floats,
    found: Floats,
) -> None:
    """Compute the largest displacement component [m] and compliance [m/N] of each neighbourhood.

    Args:
        starts: Start of each of n neighbourhoods, then the end of the last one, shape (n + 1,).
        displacement: Displacement of each vertex, shape (k, 3) [m].
        c_ii: Compliance of each vertex, shape (k,) [m/N].
        found: Set to both values, shape (n, 2); the first is -1 if any value is not finite or a
            compliance is negative.
    """
    for i in range(found.shape[0]):
        widest = softest = 0.0
        usable = True
        for k in range(starts[i], starts[i + 1]):
            for axis in range(3):
                size = abs(displacement[k, axis])
                usable = usable and size < _HUGE  # False for NaN as well
                widest = max(widest, size)
            usable = usable and 0.0 <= c_ii[k] < _HUGE
            softest = max(softest, c_ii[k])
        found[i, 0] = widest if usable else -1.0
        found[i, 1] = softest


def pack(
    starts: Ints,
    vertices: Ints,
    displacement: Floats,
    c_ii: Floats,
    per: Floats,
    numbers: np.ndarray[tuple[int, int], np.dtype[np.uint16]],
) -> int:
    """Encode every vertex as its number and its values in whole units.

    Args:
        starts, displacement, c_ii: As in `largest`.
        vertices: Number of each vertex, shape (k,).
        per: Units per metre of displacement, small enough for values below 2^15, and units per m/N
            of compliance, small enough for values below 2^16; 0 to pack zeros, shape (n, 2).
        numbers: Set to the packed values, shape (k, 5); displacements are in 2's complement.

    Returns:
        First neighbourhood with vertices that do not rise within 0 to 65,535; n if all rise.
    """
    for i in range(per.shape[0]):
        before = -1
        for k in range(starts[i], starts[i + 1]):
            vertex = vertices[k]
            if vertex <= before or vertex >= 65536:
                return i
            before = vertex
            numbers[k, 0] = vertex
            for axis in range(3):
                whole = 0
                if per[i, 0] > 0.0:
                    whole = int((displacement[k, axis] * per[i, 0] + _TO_WHOLE) - _TO_WHOLE)
                numbers[k, axis + 1] = whole & 65535
            whole = 0
            if per[i, 1] > 0.0:
                whole = int((c_ii[k] * per[i, 1] + _TO_WHOLE) - _TO_WHOLE)
            numbers[k, 4] = whole
    return int(per.shape[0])
