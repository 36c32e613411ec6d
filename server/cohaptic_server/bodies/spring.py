"""The paper's one-dimensional object (section 7): a rigid plate on a spring with a damper.

A flat plate in the y-z plane faces +x and moves along its normal as a whole. On a spring of
stiffness K_o with the damping B_o, the force f of a tick moves the plate from its position x to x+
at the next tick, eqs. (6) and (9):

    (K_o + B_o) x+ = f + B_o x.

All contacts share one motion, so the compliance C_ij is 1 / (K_o + B_o) for every pair. C is
symmetric. With two or more contacts C is only semidefinite, because two points of a rigid plate
cannot move apart.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cohaptic.errors import SettingError
from cohaptic_server.bodies.body import DenseResponse, Load, Response
from cohaptic_server.mesh.surface import SurfaceMesh
from cohaptic_server.numeric import Floats, Ints

_INWARD = np.array([-1.0, 0.0, 0.0])  # direction in which a press moves the plate


@dataclass(frozen=True, slots=True)
class SpringSettings:
    """Settings of a plate on a spring.

    Args:
        k_o: Stiffness K_o [N/m].
        b_o: Damping over the simulation period, B_o of eq. (9) [N/m].
        side: Side of the square plate [m].
        cells: Number of squares along a side; each is cut into two triangles.
        contact_radius: Radius of the pressure under a contact [m]; no effect on a rigid plate.
    """

    k_o: float = 200.0
    b_o: float = 0.0
    side: float = 0.2
    cells: int = 10
    contact_radius: float = 0.02

    def __post_init__(self) -> None:
        for name, low, high in (
            ("k_o", 1.0, 1e5),
            ("b_o", 0.0, 1e5),
            ("side", 0.01, 2.0),
            ("cells", 1, 40),
            ("contact_radius", 0.001, 0.5),
        ):
            if not low <= getattr(self, name) <= high:
                raise SettingError(f"spring {name}", getattr(self, name), f"from {low} to {high}")


class Spring:
    """A rigid plate on a spring, as a `Body`.

    Args:
        settings: Stiffness, damping and size; None takes the defaults.

    Attributes:
        mesh: Surface of the plate at rest.
        contact_radius: Radius of the pressure under a contact [m].
        linear: Whether the spring has no damping.
    """

    name = "spring"

    def __init__(self, settings: SpringSettings | None = None) -> None:
        self.settings = settings or SpringSettings()
        self.mesh = SurfaceMesh(*plate(self.settings.side, self.settings.cells))
        self.contact_radius = self.settings.contact_radius
        self.linear = self.settings.b_o == 0.0

    def respond(self, loads: Sequence[Load], before: Response | None = None) -> DenseResponse:
        """Return the plate's state one period after `loads` act, from its position in `before`."""
        k_o, b_o = self.settings.k_o, self.settings.b_o
        n = len(self.mesh.vertices)
        # Component of each force along the plate's motion: less than 1 for an oblique force.
        along = np.array([load.direction @ _INWARD for load in loads])  # (c,)
        forces = np.array([load.force for load in loads])
        previous = 0.0 if before is None else float(before.displacement[0] @ _INWARD)
        depth = (float(along @ forces) + b_o * previous) / (k_o + b_o)
        unit = np.broadcast_to(_INWARD, (n, 3))
        return DenseResponse(
            depth * unit,
            (along / (k_o + b_o))[:, None, None] * unit,
            np.outer(along, along) / (k_o + b_o),
            0.5 * k_o * depth * depth,
        )


def plate(side: float, cells: int) -> tuple[Floats, Ints]:
    """Return the mesh of a square in the y-z plane, centred at the origin, that faces +x.

    Args:
        side: Side of the square [m].
        cells: Number of cells along a side; each is cut into two triangles.

    Returns:
        Vertices ((cells + 1)^2, 3) [m] and faces (2 cells^2, 3).
    """
    line = np.linspace(-0.5 * side, 0.5 * side, cells + 1)
    y, z = (a.ravel() for a in np.meshgrid(line, line, indexing="ij"))
    corner = (np.arange(cells)[:, None] * (cells + 1) + np.arange(cells)).ravel()
    right, up = corner + cells + 1, corner + 1
    faces = np.concatenate(
        [np.stack([corner, right, up], axis=1), np.stack([right, right + 1, up], axis=1)]
    )
    return np.stack([np.zeros_like(y), y, z], axis=1), np.asarray(faces, dtype=np.int64)
