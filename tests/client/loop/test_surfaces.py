from __future__ import annotations

from dataclasses import replace

import pytest

from cohaptic.control.mesh_surface import MeshSurface
from cohaptic.protocol.neighbourhood import Neighbourhood
from cohaptic.protocol.patch import MIN_COMPLIANCE, Geometry
from cohaptic.protocol.rest_mesh import RestMesh
from cohaptic_client.loop.state import SurfaceMaker
from tests.client.plane import PLANE

# A square of nine vertices, 2 cm apart, in the plane z = 0.
SQUARE = RestMesh(
    tuple((0.02 * i, 0.02 * j, 0.0) for j in (-1, 0, 1) for i in (-1, 0, 1)),
    tuple(face for k in (0, 1, 3, 4) for face in ((k, k + 1, k + 4), (k, k + 4, k + 3))),
)


def test_a_mesh_patch_is_a_surface_of_the_vertices_that_it_names() -> None:
    lifted = 0.004
    near = Neighbourhood.of(
        range(9), [(0.0, 0.0, lifted)] * 9, [0.004 + 0.0001 * k for k in range(9)]
    )
    patch = replace(
        PLANE, geometry=Geometry.MESH, neighbourhood=near, x_free=(0.0, 0.0, lifted), c_ii=0.0044
    )
    surface = SurfaceMaker(SQUARE)(patch)
    assert isinstance(surface, MeshSurface)
    sight = surface.look((0.001, 0.002, -0.001))
    assert sight.depth == pytest.approx(lifted + 0.001, abs=1e-6)
    assert sight.normal == pytest.approx((0.0, 0.0, 1.0), abs=1e-6)
    # Vertices towards +y are softer.
    assert surface.look((0.0, 0.01, 0.0)).c_ii > surface.look((0.0, -0.01, 0.0)).c_ii
    assert (sight.own_force, sight.u_others) == (patch.own_force, patch.u_others)


def test_a_stiff_vertex_beside_soft_ones_is_no_division_by_zero() -> None:
    """Sixteen bits round its compliance to none; a loop takes 1 / C_ii of the shown surface."""
    near = Neighbourhood.of(range(9), [(0.0, 0.0, 0.0)] * 9, [0.0] * 4 + [1e-9] + [1.0] * 4)
    assert min(near.compliances) == near.compliances[4] == 0
    patch = replace(PLANE, geometry=Geometry.MESH, neighbourhood=near, c_ii=MIN_COMPLIANCE)
    surface = SurfaceMaker(SQUARE)(patch)
    c_ii = surface.look((0.0, 0.0, -0.001)).c_ii
    assert c_ii == pytest.approx(MIN_COMPLIANCE, rel=1e-6)  # vertices have single precision
