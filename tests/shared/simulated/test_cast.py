from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic.protocol.rest_mesh import RestMesh
from cohaptic.simulated.cast import cast
from cohaptic.vec import Vec3, dot, norm, sub
from cohaptic_server.mesh.icosphere import icosphere
from cohaptic_server.mesh.surface import SurfaceMesh
from cohaptic_server.mesh.tetrahedra import boundary
from cohaptic_server.numeric import Floats, Ints
from cohaptic_server.objects.surface.accept import nearest_point
from cohaptic_server.testing.blocks import block
from cohaptic_server.testing.soft_ring import ring

angles = st.floats(-math.pi, math.pi)


def rest(vertices: Floats, faces: Ints) -> RestMesh:
    return RestMesh(
        tuple((x, y, z) for x, y, z in vertices.tolist()),
        tuple((a, b, c) for a, b, c in faces.tolist()),
    )


def shapes() -> dict[str, SurfaceMesh]:
    """A tower, a ring whose middle is empty, and a ball beside the middle of its own sphere."""
    found: dict[str, SurfaceMesh] = {}
    for name, tets in {"tower": block((0.05, 0.08, 0.3), (4, 6, 20)), "ring": ring(32, 20)}.items():
        faces = boundary(tets.tets)
        used = np.unique(faces)
        found[name] = SurfaceMesh(tets.vertices[used], np.searchsorted(used, faces))
    x, faces = icosphere(3, 0.05)
    found["ball aside"] = SurfaceMesh(x + np.array([0.12, 0.03, 0.1]), faces)
    return found


SHAPES = shapes()


@pytest.mark.parametrize("name", SHAPES)
@given(angle=angles)
def test_a_hand_from_any_side_is_put_on_the_surface(name: str, angle: float) -> None:
    mesh = SHAPES[name]
    center: Vec3 = (0.0, 0.0, 0.15) if name == "tower" else (0.0, 0.0, 0.0)
    radius = float(np.linalg.norm(mesh.vertices - center, axis=1).max())
    place = cast(rest(mesh.vertices, mesh.faces), center, radius, 0.008, angle)
    nearest = nearest_point(mesh, np.array(place.point))
    # A sphere that the body fills there is taken for its surface.
    assert norm(sub(place.point, tuple(nearest.tolist()))) <= 0.021 * radius
    out = (math.cos(angle), math.sin(angle), 0.0)
    assert dot(place.inward, out) < 0.0
    assert norm(place.inward) == pytest.approx(1.0)


@given(angle=angles)
def test_on_a_ball_it_is_the_point_of_the_sphere(angle: float) -> None:
    x, faces = icosphere(3, 0.1)
    place = cast(rest(x, faces), (0.0, 0.0, 0.0), 0.1, 0.02, angle)
    out = (math.cos(angle), math.sin(angle), 0.0)
    assert place.point == pytest.approx([0.1 * k for k in out])
    assert place.inward == pytest.approx([-k for k in out])


def test_a_press_goes_in_along_the_normal() -> None:
    """A hand from 60 degrees meets the long side of the tower, whose normal is y."""
    mesh = SHAPES["tower"]
    place = cast(rest(mesh.vertices, mesh.faces), (0.0, 0.0, 0.15), 0.16, 0.008, math.radians(80))
    assert place.inward == pytest.approx((0.0, -1.0, 0.0), abs=1e-9)
    assert place.point[1] == pytest.approx(0.04)
