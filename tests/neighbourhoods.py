"""Neighbourhoods of numbers, as the surface of a mesh patch takes them."""

from __future__ import annotations

from array import array
from collections.abc import Iterable


def facts(vertices: Iterable[tuple[int, float, float, float, float]]) -> array[float]:
    """Number, displacement [m] and compliance [m/N] of each vertex, one behind the other."""
    return array("d", [float(value) for vertex in vertices for value in vertex])
