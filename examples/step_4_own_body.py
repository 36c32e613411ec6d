"""Step 4: a body of your own is a surface and its response to forces.

python examples/step_4_own_body.py [PORT]

A ball on a Pasternak foundation: springs of stiffness `foundation` per area hold each point of its
surface, below a sheet under `tension`. The displacement u under surface forces f solves
foundation A u - tension L u = f, with the area A of each vertex and the cotangent Laplacian L.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence

import numpy as np
import trimesh

from cohaptic_server import DenseResponse, Load, Response, SurfaceMesh, serve


class Cushion:
    """The ball; `radius` [m], `foundation` [N/m^3], `tension` [N/m]."""

    name = "cushion"
    contact_radius = 0.02  # m; a fingertip's pressure is spread over this
    linear = True  # it answers the sum of all loads, whatever came before

    def __init__(self, radius: float = 0.1, foundation: float = 4e3, tension: float = 80.0) -> None:
        ball = trimesh.creation.icosphere(3, radius)  # pyright: ignore[reportUnknownMemberType]
        x, faces = np.array(ball.vertices), np.array(ball.faces, dtype=np.int64)
        self.mesh = SurfaceMesh(x, faces)
        stiffness = np.zeros((len(x), len(x)))  # [N/m]
        for face in faces:
            edges = x[np.roll(face, -1)] - x[np.roll(face, -2)]  # edge k is opposite of corner k
            area = 0.5 * float(np.linalg.norm(np.cross(edges[0], edges[1])))
            # The cotangent Laplacian of one triangle: edge_i . edge_j / (4 area).
            stiffness[np.ix_(face, face)] += tension * edges @ edges.T / (4.0 * area)
            stiffness[face, face] += foundation * area / 3.0
        self._inverse = np.linalg.inv(stiffness)  # [m/N], shape (n, n)

    def respond(self, loads: Sequence[Load], before: Response | None = None) -> DenseResponse:
        """Return the ball in equilibrium with `loads`."""
        weights = np.zeros((len(loads), len(self.mesh.vertices)))
        for row, load in zip(weights, loads, strict=True):
            np.add.at(row, load.vertices, load.weights)
        directions = np.array([load.direction for load in loads]).reshape(-1, 3)
        forces = np.array([load.force for load in loads])
        reach = weights @ self._inverse  # displacement of each vertex per force of each load
        compliance = (reach @ weights.T) * (directions @ directions.T)
        fields = reach[:, :, None] * directions[:, None, :]
        moved = np.tensordot(forces, fields, axes=1)
        energy = 0.5 * float(forces @ compliance @ forces)
        return DenseResponse(moved, fields=fields, compliance=compliance, energy=energy)


if __name__ == "__main__":
    with serve(Cushion(), port=int(sys.argv[1]) if len(sys.argv) > 1 else 8765) as room:
        print(f"listening {room.url} {room.page}", flush=True)
        room.wait()
