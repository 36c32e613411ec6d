"""Vectors of three numbers, and the operations on them that the haptic loop needs.

Vectors are plain tuples instead of arrays: the loop's process then starts without numpy, and one
operation on three numbers costs a third of a microsecond.
"""

from __future__ import annotations

import math

Vec3 = tuple[float, float, float]

ZERO: Vec3 = (0.0, 0.0, 0.0)


def add(a: Vec3, b: Vec3) -> Vec3:
    """Sum, a + b."""
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])


def sub(a: Vec3, b: Vec3) -> Vec3:
    """Difference, a - b."""
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


def scale(a: Vec3, s: float) -> Vec3:
    """Multiple, s a."""
    return (a[0] * s, a[1] * s, a[2] * s)


def dot(a: Vec3, b: Vec3) -> float:
    """Inner product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Vec3, b: Vec3) -> Vec3:
    """Cross product, a x b."""
    return (
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    )


def norm(a: Vec3) -> float:
    """Euclidean length."""
    return math.sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2])


def unit(a: Vec3, fallback: Vec3 = (0.0, 0.0, 1.0)) -> Vec3:
    """Unit vector along `a`; `fallback` if `a` is no longer than 1e-12."""
    length = norm(a)
    return scale(a, 1.0 / length) if length > 1e-12 else fallback


def lerp(a: Vec3, b: Vec3, s: float) -> Vec3:
    """Linear interpolation from a (s = 0) to b (s = 1)."""
    return (a[0] + s * (b[0] - a[0]), a[1] + s * (b[1] - a[1]), a[2] + s * (b[2] - a[2]))


def is_finite(a: Vec3) -> bool:
    """Whether no component is NaN or infinite."""
    # Comparisons with NaN are false. Compiled, they need no function call, unlike isfinite.
    return abs(a[0]) < math.inf and abs(a[1]) < math.inf and abs(a[2]) < math.inf
