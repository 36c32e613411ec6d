"""The linear balloon of 2,562 vertices, solved sparsely.

The goals of watching are stated for it. `Balloon` forms all of C, which takes half a minute and
half a gigabyte at this size; a test needs only a few columns.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg

from cohaptic_server.bodies.balloon.balloon import BalloonSettings, fixed_by_base, inflate
from cohaptic_server.bodies.body import DenseResponse, Load, Response
from cohaptic_server.mesh.surface import SurfaceMesh
from cohaptic_server.numeric import Floats


class FineBalloon:
    """`Balloon` behind the `Body` Protocol, without its matrix."""

    name = "balloon"
    linear = True

    def __init__(self, subdivisions: int = 4) -> None:
        self.settings = BalloonSettings(subdivisions=subdivisions)
        inflated = inflate(self.settings)
        self.mesh = SurfaceMesh(inflated.x, inflated.faces)
        self._free = np.flatnonzero(np.repeat(~fixed_by_base(inflated, self.settings), 3))
        K = inflated.stiffness[self._free][:, self._free]
        g = sp.csr_array(inflated.volume_gradient[self._free][:, None])
        upper, lower = sp.hstack([K, g]), sp.hstack([g.T, sp.csr_array((1, 1))])
        self._solve = scipy.sparse.linalg.splu(sp.csc_array(sp.vstack([upper, lower]))).solve

    @property
    def contact_radius(self) -> float:
        return self.settings.contact_radius

    def respond(self, loads: Sequence[Load], before: Response | None = None) -> DenseResponse:
        del before
        n = len(self.mesh.vertices)
        fields = np.zeros((len(loads), n, 3))
        for i, load in enumerate(loads):
            f = np.zeros((n, 3))
            f[load.vertices] = load.weights[:, None] * load.direction
            u = np.zeros(3 * n)
            u[self._free] = self._solve(np.append(f.ravel()[self._free], 0.0))[:-1]
            fields[i] = u.reshape(n, 3)
        forces = np.array([load.force for load in loads])
        C = np.empty((len(loads), len(loads)))
        for i, load in enumerate(loads):
            C[i] = fields[:, load.vertices] @ load.direction @ load.weights
        whole: Floats = np.tensordot(forces, fields, axes=1) if loads else np.zeros((n, 3))
        return DenseResponse(whole, fields, C, 0.5 * float(forces @ C @ forces))
