"""The stiffness is the half space's and not the mesh's (science 3.5)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from cohaptic_server.bodies.solid.shape import SolidSettings
from cohaptic_server.bodies.solid.solid import Solid
from cohaptic_server.mesh.surface import face_area_vectors
from cohaptic_server.numeric import Floats, Ints
from cohaptic_server.testing.blocks import half_ball

A = 0.01  # m, radius of the punch
FAR = 300 * A  # where the half ball is held: a thousandth of the displacement is lost there
YOUNG, NU = 1e5, 0.3


@dataclass(frozen=True, eq=False)
class Pressed:
    """The compliance of a disc on a large body, along its normal.

    Args:
        body: A half ball that is held far away.
        disc: Vertices within A of the middle of its face.
        C: Between them, shape (k, k) [m/N].
    """

    body: Solid
    disc: Ints
    C: Floats

    @classmethod
    def on_mesh(cls, core: int, shells: int, first: float, order: int = 2) -> Pressed:
        """Rings of elements under the disc, shells beyond; `first` times A is the first one's."""
        # The stress has no limit at the edge of a punch: rings are narrow there, on both sides.
        inner = A * (1.0 - (1.0 - np.linspace(0.0, 1.0, core + 1)) ** 2)
        thickness = A * first * _growth(first, shells) ** np.arange(shells, dtype=np.float64)
        outer = np.asarray(A + np.cumsum(thickness), dtype=np.float64)
        mesh = half_ball(inner, outer)
        held = np.linalg.norm(mesh.vertices, axis=1) > 0.99 * FAR
        body = Solid(mesh, held, SolidSettings(YOUNG, NU, contact_radius=A, order=order))
        x = body.mesh.vertices
        near = np.hypot(x[:, 0], x[:, 1]) < 1.0001 * A
        disc = np.flatnonzero(near & (np.abs(x[:, 2]) < 1e-9))
        down = np.zeros((len(disc), 3, len(disc)))
        down[:, 2] = np.eye(len(disc))
        C = body.columns.respond(disc, down).reshape(len(disc), -1, 3)[:, disc, 2]
        return cls(body, disc, C)

    def punch(self) -> float:
        """Force per depth of a rigid flat punch without friction [N/m]."""
        return float(np.linalg.solve(self.C, np.ones(len(self.disc))).sum())

    def uniform(self) -> float:
        """Mean displacement under a uniform pressure of 1 Pa [m]."""
        mesh = self.body.mesh
        faces = mesh.faces[np.isin(mesh.faces, self.disc).all(axis=1)]
        areas = np.linalg.norm(face_area_vectors(mesh.vertices, faces), axis=1)
        fraction = np.bincount(np.searchsorted(self.disc, faces.ravel()), np.repeat(areas / 3.0, 3))
        fraction = fraction / fraction.sum()
        return float(fraction @ self.C @ fraction) * np.pi * A**2


def _growth(first: float, shells: int) -> float:
    """Ratio of each shell's thickness to the last one's, so that they end at FAR."""
    low, high = 1.01, 100.0
    for _ in range(60):
        ratio = 0.5 * (low + high)
        reached = A + A * first * (ratio**shells - 1.0) / (ratio - 1.0)
        low, high = (ratio, high) if reached < FAR else (low, ratio)
    return 0.5 * (low + high)


@pytest.fixture(scope="module")
def meshes() -> list[Pressed]:
    return [Pressed.on_mesh(1, 6, 0.3), Pressed.on_mesh(2, 8, 0.15), Pressed.on_mesh(3, 9, 0.1)]


def errors(found: list[float], exact: float) -> list[float]:
    return [abs(value / exact - 1.0) for value in found]


def test_a_flat_punch_converges_to_the_half_space(meshes: list[Pressed]) -> None:
    """K = 2 a E / (1 - nu^2)."""
    off = errors([mesh.punch() for mesh in meshes], 2.0 * A * YOUNG / (1.0 - NU**2))
    assert off[0] > off[1] > off[2]
    assert off[2] < 0.03


def test_a_uniform_pressure_converges_to_the_half_space(meshes: list[Pressed]) -> None:
    """16 q a (1 - nu^2) / (3 pi E)."""
    exact = 16.0 * A * (1.0 - NU**2) / (3.0 * np.pi * YOUNG)
    off = errors([mesh.uniform() for mesh in meshes], exact)
    assert off[0] > off[1] > off[2]
    assert off[2] < 0.03


def test_quadratic_elements_are_worth_their_cost() -> None:
    """A few quadratic elements beat many times as many linear ones."""
    few, many = Pressed.on_mesh(1, 6, 0.3), Pressed.on_mesh(3, 9, 0.1, order=1)
    exact = 2.0 * A * YOUNG / (1.0 - NU**2)
    quadratic, linear = errors([few.punch(), many.punch()], exact)
    assert quadratic < linear
    assert few.body.factor_bytes < many.body.factor_bytes
