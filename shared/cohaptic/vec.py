"""Vectors of three numbers, and the operations on them that the haptic loop needs.

Vectors are tuples instead of numpy arrays: the loop's process then starts without numpy, and one
operation on three numbers takes a third of a microsecond.
"""

from __future__ import annotations

import math

Vec3 = tuple[float, float, float]

ZERO: Vec3 = (0.0, 0.0, 0.0)


def add(a: Vec3, b: Vec3) -> Vec3:
    """Return the sum a + b."""
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])


def sub(a: Vec3, b: Vec3) -> Vec3:
    """Return the difference a - b."""
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


def scale(a: Vec3, s: float) -> Vec3:
    """Return the multiple s a."""
    return (a[0] * s, a[1] * s, a[2] * s)


def dot(a: Vec3, b: Vec3) -> float:
    """Return the inner product a . b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Vec3, b: Vec3) -> Vec3:
    """Return the cross product a x b."""
    return (
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    )


def norm(a: Vec3) -> float:
    """Return the Euclidean length of a vector."""
    return math.sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2])


def unit(a: Vec3, fallback: Vec3 = (0.0, 0.0, 1.0)) -> Vec3:
    """Return the unit vector along `a`; `fallback` if `a` has a length of at most 1e-12."""
    length = norm(a)
    return scale(a, 1.0 / length) if length > 1e-12 else fallback


def lerp(a: Vec3, b: Vec3, s: float) -> Vec3:
    """Interpolate linearly from a (s = 0) to b (s = 1)."""
    return (a[0] + s * (b[0] - a[0]), a[1] + s * (b[1] - a[1]), a[2] + s * (b[2] - a[2]))


def is_finite(a: Vec3) -> bool:
    """Return whether all components are finite."""
    # Comparisons with NaN are false. Compiled, they need no function call, unlike isfinite.
    return abs(a[0]) < math.inf and abs(a[1]) < math.inf and abs(a[2]) < math.inf
