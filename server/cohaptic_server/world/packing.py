"""The numbers of a neighbourhood as whole units: the inner loops of `world/neighbourhood.py`."""

from __future__ import annotations

import numpy as np

from cohaptic_server.numeric import Floats, Ints

FIELDS = 5  # of a vertex: its number, three of displacement, compliance
# Adding it rounds a double to the nearest whole number, and halves to the even one, as `round`.
_TO_WHOLE = 6755399441055744.0
_HUGE = 1e300


def largest(displacement: Floats, c_ii: Floats, found: Floats) -> bool:
    """The largest size of a displacement [m] and of a compliance [m/N].

    Args:
        displacement: Shape (k, 3) [m].
        c_ii: Shape (k,) [m/N].
        found: Set to both, shape (2,).

    Returns:
        Whether all are finite, and no compliance is negative.
    """
    most = c_most = 0.0
    for k in range(c_ii.shape[0]):
        for axis in range(3):
            size = abs(displacement[k, axis])
            if not size < _HUGE:  # nor is NaN
                return False
            most = max(most, size)
        if not 0.0 <= c_ii[k] < _HUGE:
            return False
        c_most = max(c_most, c_ii[k])
    found[0] = most
    found[1] = c_most
    return True


def pack(
    vertices: Ints,
    displacement: Floats,
    c_ii: Floats,
    per: float,
    c_per: float,
    numbers: np.ndarray[tuple[int, int], np.dtype[np.uint16]],
) -> bool:
    """Write every vertex as its number and its values in whole units.

    Args:
        vertices: Shape (k,).
        displacement: Shape (k, 3) [m].
        c_ii: Shape (k,) [m/N].
        per: Units of displacement in a metre, so that each is below 2^15.
        c_per: Units of compliance in 1 m/N, so that each is below 2^16.
        numbers: Set to them, shape (k, 5); displacements are signed, as 2's complement.

    Returns:
        Whether the vertices rise, from 0 or more to at most 65,535.
    """
    before = -1
    rising = True
    for k in range(vertices.shape[0]):
        vertex = vertices[k]
        if vertex <= before or vertex >= 65536:
            rising = False
            break
        before = vertex
        numbers[k, 0] = vertex
        for axis in range(3):
            whole = int((displacement[k, axis] * per + _TO_WHOLE) - _TO_WHOLE)
            numbers[k, axis + 1] = whole & 65535
        numbers[k, 4] = int((c_ii[k] * c_per + _TO_WHOLE) - _TO_WHOLE)
    return rising
