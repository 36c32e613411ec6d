"""Thin elastic parts that two hands press from both sides, and where they press them.

The ensemble of `limb_stability.py`: limbs as animals have them, and a long rod.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from cohaptic.simulated.hand import Place
from cohaptic_server.bodies.solid.shape import SolidSettings
from cohaptic_server.bodies.solid.solid import Solid
from cohaptic_server.mesh.tetrahedra import TetMesh
from cohaptic_server.numeric import Floats, Ints, Mask, vec3
from cohaptic_server.testing.blocks import block

CONTACT_RADIUS = 0.008  # m; of a fingertip
_NEAR = 0.015  # m along the limb between two hands, at most
_OPPOSITE = np.radians(60.0)  # by how much they may miss each other round the limb


@dataclass(frozen=True, slots=True)
class Press:
    """How one hand presses.

    Args:
        place: Of the surface.
        depth: Intended, beyond it [m].
    """

    place: Place
    depth: float


def round_limb(root: float, tip: float, length: float, stretch: float = 1.0) -> Solid:
    """A tapered limb that hangs from z = `length`; an ear with another `stretch` than 1.

    Args:
        root: Radius where it is held [m].
        tip: Radius of its free end [m].
        length: [m].
        stretch: Width over thickness of its section.
    """
    cube = block((2.0, 2.0, length), (4, 4, 14))
    x = cube.vertices.copy()
    out = x[:, :2]
    squared = np.abs(out).max(axis=1) / np.maximum(np.linalg.norm(out, axis=1), 1e-12)
    x[:, :2] = out * (squared * (tip + (root - tip) * x[:, 2] / length))[:, None]
    x[:, 0] *= stretch
    return _solid(x, cube.tets, x[:, 2] > length - 1e-3, 6e4)


def _solid(vertices: Floats, tets: Ints, held: Mask, young: float) -> Solid:
    settings = SolidSettings(young, 0.45, CONTACT_RADIUS)
    return Solid(TetMesh.checked(vertices, tets), np.asarray(held), settings)


LIMBS: dict[str, Callable[[], Solid]] = {
    "limb": lambda: round_limb(0.016, 0.012, 0.12),
    "leg": lambda: round_limb(0.02, 0.01, 0.09),
    "ear": lambda: round_limb(0.01, 0.006, 0.08, 2.0),
    "rod": lambda: round_limb(0.01, 0.01, 0.2),
}


def draw(body: Solid, seed: int) -> tuple[Press, Press]:
    """Two hands on opposite sides of the lower half of a limb, near each other along it.

    Args:
        body: One of `LIMBS`.
        seed: Of the places, and of the depths from 6 to 20 mm.
    """
    rng = np.random.default_rng(seed)
    x, normals = body.mesh.vertices, body.mesh.normals
    length = float(x[:, 2].max())
    height = rng.uniform(0.1, 0.5) * length
    angle = rng.uniform(-np.pi, np.pi)
    presses: list[Press] = []
    for k in range(2):
        turned = angle + k * np.pi + rng.uniform(-0.5, 0.5) * _OPPOSITE
        at = height + rng.uniform(-0.5, 0.5) * _NEAR
        out = np.array([np.cos(turned), np.sin(turned), 0.0])
        beside = np.abs(x[:, 2] - at)
        found = int(np.argmax(x @ out - 10.0 * beside))
        depth = rng.uniform(0.006, 0.02)
        presses.append(Press(Place(vec3(x[found]), vec3(-normals[found])), depth))
    return presses[0], presses[1]
