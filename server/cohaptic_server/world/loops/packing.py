"""Packing of neighbourhoods into whole units: the inner loops of `world/neighbourhood.py`."""

from __future__ import annotations

import numpy as np

from cohaptic_server.numeric import Floats, Ints

FIELDS = 5  # values per vertex: its number, three of displacement, compliance
# Adding and subtracting it rounds a double to the nearest whole number, halves to even as `round`.
_TO_WHOLE = 6755399441055744.0
_HUGE = 1e300


def largest(
    starts: Ints,
    displacement: Floats,
    c_ii: Floats,
    found: Floats,
) -> None:
    """Find the largest displacement component [m] and compliance [m/N] of each neighbourhood.

    Args:
        starts: Where each of n neighbourhoods begins, and the last one's end, shape (n + 1,).
        displacement: Shape (k, 3) [m].
        c_ii: Shape (k,) [m/N].
        found: Set to both, shape (n, 2); the first is -1 where a value is not finite or a
            compliance is negative.
    """
    for i in range(found.shape[0]):
        most = c_most = 0.0
        usable = True
        for k in range(starts[i], starts[i + 1]):
            for axis in range(3):
                size = abs(displacement[k, axis])
                usable = usable and size < _HUGE  # False for NaN as well
                most = max(most, size)
            usable = usable and 0.0 <= c_ii[k] < _HUGE
            c_most = max(c_most, c_ii[k])
        found[i, 0] = most if usable else -1.0
        found[i, 1] = c_most


def pack(
    starts: Ints,
    vertices: Ints,
    displacement: Floats,
    c_ii: Floats,
    per: Floats,
    numbers: np.ndarray[tuple[int, int], np.dtype[np.uint16]],
) -> int:
    """Write every vertex as its number and its values in whole units.

    Args:
        starts, displacement, c_ii: As in `largest`.
        vertices: Shape (k,).
        per: Units of displacement in a metre, so that each is below 2^15, and of compliance in
            1 m/N, so that each is below 2^16; 0 for a neighbourhood that is left out, shape (n, 2).
        numbers: Set to the packed values, shape (k, 5); displacements are in 2's complement.

    Returns:
        First neighbourhood whose vertices do not rise within 0 to 65,535; n if there is none.
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
