"""A sheet on springs that harden, as a body that is not linear.

The sheet is held at its rim and gives way along its normal only. Each of its points is held by a
spring to the ground whose force grows with the third power of the displacement, too:

    k u + k3 u^3 - tension * laplacian(u) = p,    u = 0 at the rim

on a square grid. A body of this kind says `linear = False`: clients then move no models of the
other hands, since the models superpose what each hand does.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
from scipy.linalg import cho_factor, cho_solve

from cohaptic_server import DenseResponse, Load, Response, SurfaceMesh

Floats = npt.NDArray[np.float64]

NODES = 15  # on a side
TOLERANCE = 1e-10  # N; largest residual at a node
ITERATIONS = 40  # of Newton; from the response of the tick before, two or three are enough


class Sheet:
    """A sheet that stands upright and faces +x.

    Args:
        side: Side of the sheet [m].
        k: Stiffness of the ground per area [N/m^3].
        k3: Hardening of the ground per area [N/m^5].
        tension: Tension of the sheet [N/m].
    """

    name = "sheet"
    contact_radius = 0.02  # m; a fingertip's pressure is spread over this
    linear = False

    def __init__(
        self, side: float = 0.2, k: float = 3e3, k3: float = 3e8, tension: float = 60.0
    ) -> None:
        along = np.linspace(-0.5 * side, 0.5 * side, NODES)
        y, z = (axis.ravel() for axis in np.meshgrid(along, along, indexing="ij"))
        node = np.arange(NODES * NODES).reshape(NODES, NODES)
        a, b, c, d = (
            part.ravel() for part in (node[:-1, :-1], node[1:, :-1], node[1:, 1:], node[:-1, 1:])
        )
        faces = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
        self.mesh = SurfaceMesh(np.stack([np.zeros(len(y)), y, z], axis=1), faces)
        area = (side / (NODES - 1)) ** 2  # of the ground under a node [m^2]
        laplacian = np.zeros((len(y), len(y)))
        for along_one in (node, node.T):  # the edges along either side
            p, q = along_one[:-1].ravel(), along_one[1:].ravel()
            np.add.at(laplacian, (p, p), 1.0)
            np.add.at(laplacian, (q, q), 1.0)
            np.add.at(laplacian, (p, q), -1.0)
            np.add.at(laplacian, (q, p), -1.0)
        self._free = node[1:-1, 1:-1].ravel()
        stiffness = tension * laplacian + k * area * np.eye(len(y))
        self._stiffness = stiffness[np.ix_(self._free, self._free)]  # [N/m]
        self._hardening = k3 * area  # [N/m^3]

    def respond(self, loads: Sequence[Load], before: Response | None = None) -> DenseResponse:
        """The sheet in equilibrium with `loads`; the search begins at the response `before`."""
        n, free = len(self.mesh.vertices), self._free
        weights = np.zeros((len(loads), n))
        for row, load in zip(weights, loads, strict=True):
            # The part of each force that is normal to the sheet moves it.
            np.add.at(row, load.vertices, load.weights * load.direction[0])
        pushed = weights[:, free]
        pressure = np.array([load.force for load in loads]) @ pushed
        u = np.zeros(len(free)) if before is None else before.displacement[free, 0]
        u, tangent = self._equilibrium(pressure, u)
        each = cho_solve(tangent, pushed.T).T
        displacement, fields = np.zeros((n, 3)), np.zeros((len(loads), n, 3))
        displacement[free, 0], fields[:, free, 0] = u, each
        energy = 0.5 * u @ self._stiffness @ u + 0.25 * self._hardening * np.sum(u**4)
        return DenseResponse(displacement, fields, each @ pushed.T, float(energy))

    def _equilibrium(self, pressure: Floats, u: Floats) -> tuple[Floats, tuple[Floats, bool]]:
        """Return the displacement of the free nodes under a force on each, and the tangent there.

        Raises:
            ArithmeticError: No equilibrium was found.
        """
        for _ in range(ITERATIONS):
            residual = self._stiffness @ u + self._hardening * u**3 - pressure
            hardened = np.diag(3.0 * self._hardening * u**2)
            tangent = cho_factor(self._stiffness + hardened)
            if np.abs(residual).max() < TOLERANCE:
                return u, tangent
            u = u - cho_solve(tangent, residual)
        raise ArithmeticError(f"no equilibrium of the sheet within {ITERATIONS} iterations")
