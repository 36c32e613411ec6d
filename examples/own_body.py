"""A deformable body of one's own in one file, and a server that lets people touch it.

The body is a ball on a Pasternak foundation: each point of its surface is held by springs of
stiffness `foundation` per area, below a sheet under `tension` that carries a press on to its
neighbours. The displacement u under surface forces f solves

    foundation * A u - tension * L u = f

for each axis, with the area A of each vertex and the cotangent Laplacian L of the mesh.

    python examples/own_body.py
    cohaptic touch ws://127.0.0.1:8765 --name ann --rhythm-s 4
"""

from __future__ import annotations

import asyncio
import sys
from collections.abc import Sequence

import numpy as np
import trimesh

from cohaptic_server import (
    CohapticServer,
    DenseResponse,
    Load,
    Response,
    ServerSettings,
    SurfaceMesh,
)


class Cushion:
    """A ball on a Pasternak foundation; it has what the Protocol `Body` asks for.

    Args:
        radius: [m].
        foundation: Stiffness of the springs per area of the surface [N/m^3].
        tension: Tension of the sheet [N/m].
    """

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
        """The ball in equilibrium with `loads`."""
        weights = np.zeros((len(loads), len(self.mesh.vertices)))
        for row, load in zip(weights, loads, strict=True):
            np.add.at(row, load.vertices, load.weights)
        directions = np.array([load.direction for load in loads]).reshape(-1, 3)
        forces = np.array([load.force for load in loads])
        reach = weights @ self._inverse  # displacement of each vertex per force of each load
        compliance = (reach @ weights.T) * (directions @ directions.T)
        fields = reach[:, :, None] * directions[:, None, :]
        return DenseResponse(
            displacement=np.tensordot(forces, fields, axes=1),
            fields=fields,
            compliance=compliance,
            energy=0.5 * float(forces @ compliance @ forces),
        )


async def serve(settings: ServerSettings) -> None:
    """Let people touch a cushion until they press Ctrl-C."""
    server = CohapticServer(Cushion(), settings)
    print(f"listening {await server.start()}", flush=True)
    await server.run()


if __name__ == "__main__":
    port = int(sys.argv[1]) if len(sys.argv) > 1 else 8765
    try:
        asyncio.run(serve(ServerSettings(port=port)))
    except KeyboardInterrupt:
        print("stopped")
