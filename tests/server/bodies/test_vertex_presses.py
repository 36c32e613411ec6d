"""Presses at many vertices are those that a tick computes one by one."""

from __future__ import annotations

import numpy as np
import pytest

from cohaptic_server.bodies.balloon.balloon import Balloon
from cohaptic_server.bodies.spring import plate
from cohaptic_server.bodies.vertex_presses import presses_at
from cohaptic_server.mesh.surface import SurfaceMesh, pressure


def thin_plate() -> SurfaceMesh:
    """Two sides 2 mm apart: a finger on one of them does not press the other, which it covers."""
    x, faces = plate(0.1, 10)
    behind = x - 0.002 * SurfaceMesh(x, faces).normals
    both = np.concatenate([faces, faces[:, ::-1] + len(x)])
    return SurfaceMesh(np.concatenate([x, behind]), both)


@pytest.mark.parametrize("cells", [2, 4, 8])
def test_springs_below_each_point_feel_three_quarters_as_stiff_as_their_sum(cells: int) -> None:
    """K = 3/4 k pi a^2 for the pressure 1 - r^2/a^2 of a finger, as docs/how-to/write-a-body.md.

    The edge of a cell over the contact radius, squared, is about the share that a mesh adds.
    """
    radius, foundation = 0.02, 3e5  # m, N/m^3
    edge = radius / cells
    mesh = SurfaceMesh(*plate(6.0 * radius, 6 * cells))
    corners = mesh.quadrature.areas[:, None] * mesh.quadrature.fractions
    area = np.bincount(mesh.quadrature.vertices.ravel(), corners.ravel())
    middle = np.array([int(np.linalg.norm(mesh.vertices, axis=1).argmin())])
    (load,) = presses_at(mesh, middle, radius)
    stiffness = 1.0 / float(load.weights**2 @ (1.0 / (foundation * area[load.vertices])))
    whole = 0.75 * foundation * np.pi * radius**2
    assert stiffness / whole - 1.0 == pytest.approx((edge / radius) ** 2, rel=0.2)


@pytest.mark.parametrize("radius", [0.0005, 0.01, 0.03, 1.0])  # below a cell, some, and all
@pytest.mark.parametrize("shape", ["balloon", "plate", "sides"])
def test_they_are_those_of_single_presses(
    shape: str, radius: float, small_balloon: Balloon
) -> None:
    made = {"balloon": lambda: small_balloon.mesh, "sides": thin_plate}
    mesh = made.get(shape, lambda: SurfaceMesh(*plate(0.1, 10)))()
    vertices = np.arange(0, len(mesh.vertices), 5)
    for vertex, load in zip(vertices, presses_at(mesh, vertices, radius), strict=True):
        normal = mesh.normals[vertex]
        under, weights = pressure(mesh, mesh.vertices[vertex], radius, normal)
        assert np.array_equal(load.vertices, under)
        # The parts are added in another order.
        assert load.weights == pytest.approx(weights, rel=1e-12, abs=1e-15)
        assert np.array_equal(load.direction, -normal)
        assert load.force == 0.0
