"""Creatures of blended limbs: a figure as tall as a person, an animal, a rabbit with thin ears."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from shapes.grids import Mesh, standing
from shapes.implicit import Limb, blended, surface


def figure() -> Mesh:
    """A figure 1.7 m tall that stands with its arms away from its sides."""
    limbs = [
        Limb((0.0, 0.0, 0.98), (0.0, 0.0, 1.30), (0.15, 0.17)),
        Limb((0.0, 0.0, 1.30), (0.0, 0.0, 1.52), (0.08, 0.07)),
        Limb((0.0, 0.0, 1.56), (0.0, 0.01, 1.60), (0.10, 0.10)),
    ]
    for side in (-1.0, 1.0):
        limbs += [
            Limb((0.16 * side, 0.0, 1.38), (0.34 * side, 0.0, 1.12), (0.065, 0.05)),
            Limb((0.34 * side, 0.0, 1.12), (0.42 * side, 0.05, 0.84), (0.05, 0.04)),
            Limb((0.10 * side, 0.0, 0.94), (0.13 * side, 0.0, 0.50), (0.095, 0.06)),
            Limb((0.13 * side, 0.0, 0.50), (0.14 * side, 0.0, 0.06), (0.06, 0.05)),
            Limb((0.14 * side, 0.02, 0.04), (0.15 * side, -0.14, 0.04), (0.045, 0.035)),
        ]
    x, faces = standing(_skin(limbs, blend=0.012, cell=0.022))
    return x * (1.7 / float(x[:, 2].max())), faces


def animal() -> Mesh:
    """A quadruped 0.3 m long, with head, snout, ears and tail."""
    limbs = [
        Limb((-0.09, 0.0, 0.14), (0.07, 0.0, 0.145), (0.045, 0.05)),
        Limb((0.07, 0.0, 0.15), (0.135, 0.0, 0.20), (0.035, 0.03)),
        Limb((0.13, 0.0, 0.205), (0.185, 0.0, 0.19), (0.032, 0.016)),
        Limb((-0.12, 0.0, 0.16), (-0.17, 0.0, 0.10), (0.014, 0.008)),
    ]
    for side in (-1.0, 1.0):
        limbs += [
            Limb((0.075, 0.03 * side, 0.13), (0.08, 0.038 * side, 0.012), (0.02, 0.014)),
            Limb((-0.10, 0.03 * side, 0.13), (-0.105, 0.038 * side, 0.012), (0.024, 0.014)),
            Limb((0.115, 0.02 * side, 0.225), (0.10, 0.032 * side, 0.25), (0.011, 0.007)),
        ]
    return standing(_skin(limbs, blend=0.004, cell=0.0065))


def rabbit() -> Mesh:
    """A sitting rabbit 0.15 m tall, with ears 5 mm thick."""
    limbs = [
        Limb((0.0, 0.0, 0.035), (0.01, 0.0, 0.05), (0.035, 0.03)),
        Limb((0.03, 0.0, 0.085), (0.035, 0.0, 0.085), (0.02, 0.018)),
        Limb((-0.035, 0.0, 0.03), (-0.04, 0.0, 0.03), (0.012, 0.01)),
    ]
    for side in (-1.0, 1.0):
        limbs += [
            Limb((0.0, 0.022 * side, 0.012), (0.04, 0.026 * side, 0.01), (0.014, 0.01)),
            Limb((0.03, 0.008 * side, 0.05), (0.038, 0.01 * side, 0.012), (0.01, 0.008)),
            Limb((0.022, 0.009 * side, 0.095), (0.008, 0.014 * side, 0.142), (0.009, 0.008), 3.2),
        ]
    return standing(_skin(limbs, blend=0.0012, cell=0.0026))


def _skin(limbs: Sequence[Limb], blend: float, cell: float) -> Mesh:
    """The surface of limbs.

    Args:
        limbs: The limbs.
        blend: Width over which they flow into each other [m].
        cell: Edge of a cell of the grid [m].
    """
    ends = np.array([end for limb in limbs for end in (limb.start, limb.end)])
    # The blend swells a place where k limbs meet by blend log k, of at most all of them.
    room = max(max(limb.radii) for limb in limbs) + blend * np.log(len(limbs)) + 2.0 * cell
    return surface(blended(limbs, blend), ends.min(axis=0) - room, ends.max(axis=0) + room, cell)
