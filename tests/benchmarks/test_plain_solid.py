"""The solid that benchmarks compare with is elastic by itself, and agrees with the body."""

from __future__ import annotations

import numpy as np
import pytest

import plain_solid
from cohaptic_server.bodies.solid.parts import stiffness_of
from cohaptic_server.bodies.solid.shape import SolidSettings, SolidShape, shape_of
from cohaptic_server.mesh.surface import pressure
from cohaptic_server.mesh.tetrahedra import TetMesh
from cohaptic_server.testing.blocks import block

SIZE = (0.1, 0.08, 0.06)  # m


def shaken(order: int) -> SolidShape:
    """A block whose inner vertices are anywhere near their places."""
    mesh = block(SIZE, (3, 3, 3))
    low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    inner = ((mesh.vertices > low + 1e-6) & (mesh.vertices < high - 1e-6)).all(axis=1)
    noise = np.random.default_rng(1).uniform(-0.004, 0.004, mesh.vertices.shape)
    tets = TetMesh.checked(mesh.vertices + inner[:, None] * noise, mesh.tets)
    return shape_of(tets, mesh.vertices[:, 2] <= 0.0, SolidSettings(1e5, 0.3, order=order))


@pytest.mark.parametrize("order", [1, 2])
def test_a_block_that_is_pulled_evenly_has_the_energy_of_hookes_law(order: int) -> None:
    shape = shaken(order)
    # Stretched along z by a thousandth, and free to get thinner.
    u = shape.nodes * np.array([-0.3, -0.3, 1.0]) * 1e-3
    energy = 0.5 * u.ravel() @ (plain_solid.stiffness(shape) @ u.ravel())
    assert energy == pytest.approx(0.5 * 1e5 * 1e-6 * np.prod(SIZE), rel=1e-9)


@pytest.mark.parametrize("order", [1, 2])
def test_it_has_the_stiffness_of_the_body(order: int) -> None:
    shape = shaken(order)
    difference = plain_solid.stiffness(shape) - stiffness_of(shape)
    assert abs(difference).max() < 1e-9 * abs(stiffness_of(shape)).max()


def test_a_press_is_that_of_the_body_but_for_the_fineness_of_its_rule() -> None:
    shape = shaken(2)
    for vertex in range(0, len(shape.mesh.vertices), 7):
        under, weights = pressure(
            shape.mesh,
            shape.mesh.vertices[vertex],
            shape.contact_radius,
            shape.mesh.normals[vertex],
        )
        body = np.zeros(len(shape.nodes))
        body[shape.surface[under]] = weights
        found = plain_solid.press(shape, vertex)
        assert found.sum() == pytest.approx(1.0)
        assert found == pytest.approx(body, abs=0.05)
