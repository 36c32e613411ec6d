"""A soft block in a stiff one, on a grid that follows both: a reference."""

from __future__ import annotations

import numpy as np

from closed_forms import Hooke
from cohaptic_server.bodies.solid.shape import Moduli, SolidSettings
from cohaptic_server.bodies.solid.solid import Solid
from cohaptic_server.numeric import Floats
from cohaptic_server.testing.blocks import grid
from cohaptic_server.world.contact import locate

# Corners of the stiff block and of the soft one in it [m]: 5 mm below the surface.
BOX = ((-0.05, -0.05, 0.0), (0.05, 0.05, 0.06))
INSIDE = ((-0.015, -0.015, 0.03), (0.015, 0.015, 0.055))
RADIUS = 0.01  # m, of the press


def reference(stiff: Hooke, soft: Hooke, fine: int = 8) -> float:
    """Compliance of a press above the soft block, along the normal [m/N].

    Args:
        stiff: Young's modulus of the block.
        soft: That of the block in it.
        fine: Cells along half of the soft block; 8 is 1 % above 6.
    """
    side = _lines([(-0.05, -0.015, fine // 2), (-0.015, 0.015, 2 * fine), (0.015, 0.05, fine // 2)])
    up = _lines(
        [(0.0, 0.006, 1), (0.006, 0.03, fine // 2), (0.03, 0.055, fine), (0.055, 0.06, fine // 3)]
    )
    mesh = grid(side, side, up)
    middle = mesh.vertices[mesh.tets].mean(axis=1)
    within = ((middle > np.array(INSIDE[0])) & (middle < np.array(INSIDE[1]))).all(axis=1)
    moduli = Moduli(np.where(within, soft.young, stiff.young), np.where(within, soft.nu, stiff.nu))
    settings = SolidSettings(contact_radius=RADIUS)
    solid = Solid(mesh, mesh.vertices[:, 2] <= 0.00601, settings, moduli=moduli)
    free = np.zeros_like(solid.mesh.vertices)
    contact = locate(solid.mesh, np.array([0.0, 0.0, BOX[1][2]]), free, radius=RADIUS)
    return float(solid.respond([contact.load(1.0)]).compliance[0, 0])


def _lines(spans: list[tuple[float, float, int]]) -> Floats:
    """Planes of a grid: each span cut into so many cells."""
    cut = [np.linspace(low, high, count + 1)[:-1] for low, high, count in spans]
    return np.concatenate([*cut, [spans[-1][1]]])
