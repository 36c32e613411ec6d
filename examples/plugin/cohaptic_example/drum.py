"""The skin of a drum: a round membrane under tension, held at its rim.

It gives way along its normal only. Its displacement u under a pressure p solves

    -tension * laplacian(u) = p,    u = 0 at the rim

on a mesh of triangles, with the cotangent Laplacian.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cohaptic_server import DenseResponse, Load, Response, SurfaceMesh

RINGS, SPOKES = 12, 48


class Drum:
    """A drum that stands upright and faces +x.

    Args:
        radius: Radius of the skin [m].
        tension: Tension of the skin [N/m].
    """

    name = "drum"
    contact_radius = 0.02  # m; a fingertip's pressure is spread over this
    linear = True  # it answers the sum of all loads, whatever came before

    def __init__(self, radius: float = 0.15, tension: float = 100.0) -> None:
        self.mesh, rim = _disc(radius)
        x, faces = self.mesh.vertices, self.mesh.faces
        stiffness = np.zeros((len(x), len(x)))  # [N/m]
        for face in faces:
            edges = x[np.roll(face, -1)] - x[np.roll(face, -2)]  # edge k is opposite of corner k
            area = 0.5 * float(np.linalg.norm(np.cross(edges[0], edges[1])))
            stiffness[np.ix_(face, face)] += tension * edges @ edges.T / (4.0 * area)
        free = np.flatnonzero(~rim)
        self._give = np.zeros_like(stiffness)  # displacement at a vertex per force at one [m/N]
        self._give[np.ix_(free, free)] = np.linalg.inv(stiffness[np.ix_(free, free)])

    def respond(self, loads: Sequence[Load], before: Response | None = None) -> DenseResponse:
        """The skin in equilibrium with `loads`."""
        weights = np.zeros((len(loads), len(self.mesh.vertices)))
        for row, load in zip(weights, loads, strict=True):
            np.add.at(row, load.vertices, load.weights)
        along = np.array([load.direction[0] for load in loads])  # what of a force is normal to it
        forces = np.array([load.force for load in loads])
        moved = along[:, None] * (weights @ self._give)  # of each vertex per force of each load
        fields = moved[:, :, None] * np.array([1.0, 0.0, 0.0])
        compliance = along[:, None] * (weights @ moved.T)
        return DenseResponse(
            displacement=np.tensordot(forces, fields, axes=1),
            fields=fields,
            compliance=compliance,
            energy=0.5 * float(forces @ compliance @ forces),
        )


def _disc(radius: float) -> tuple[SurfaceMesh, np.ndarray[tuple[int], np.dtype[np.bool_]]]:
    """A disc of rings in the y-z plane, and which of its vertices are at its rim."""
    turn = 2.0 * np.pi * np.arange(SPOKES) / SPOKES
    circle = np.stack([np.zeros(SPOKES), np.cos(turn), np.sin(turn)], axis=1)
    rings = [k / RINGS * radius * circle for k in range(1, RINGS + 1)]
    here, next_ = np.arange(SPOKES), np.roll(np.arange(SPOKES), -1)
    faces = [np.stack([np.zeros(SPOKES, dtype=np.int64), 1 + here, 1 + next_], axis=1)]
    for k in range(RINGS - 1):
        a, b = 1 + k * SPOKES + here, 1 + k * SPOKES + next_
        c, d = a + SPOKES, b + SPOKES
        faces += [np.stack([a, c, b], axis=1), np.stack([b, c, d], axis=1)]
    vertices = np.concatenate([np.zeros((1, 3)), *rings])
    rim = np.arange(len(vertices)) > (RINGS - 1) * SPOKES
    return SurfaceMesh(vertices, np.concatenate(faces)), rim
