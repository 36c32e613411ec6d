"""Types of arrays, and vector operations for which numpy is slow on a few rows."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from cohaptic.vec import Vec3

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]
Mask = npt.NDArray[np.bool_]
Complex = npt.NDArray[np.complex128]
Narrow = npt.NDArray[np.float32]

_YZX, _ZXY = np.array([1, 2, 0]), np.array([2, 0, 1])


def cross(a: Floats, b: Floats) -> Floats:
    """Return the cross product of each row of `a` with the same row of `b`, shape (m, 3).

    For a few rows this is five times as fast as numpy's function.
    """
    return np.asarray(a[:, _YZX] * b[:, _ZXY] - a[:, _ZXY] * b[:, _YZX])


def vec3(a: Floats) -> Vec3:
    """Convert an array of shape (3,) to a tuple of Python floats."""
    return (float(a[0]), float(a[1]), float(a[2]))


def union(*parts: Ints) -> Ints:
    """Return the distinct numbers in several arrays, sorted; 3 times as fast as `np.union1d`."""
    numbers = np.concatenate(parts)
    numbers.sort()
    different = np.ones(len(numbers), dtype=np.bool_)
    np.not_equal(numbers[1:], numbers[:-1], out=different[1:])
    return np.asarray(numbers[different])
