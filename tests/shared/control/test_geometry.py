from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic.control.geometry import LocalSurface, blend, depth, normal_at
from cohaptic.vec import Vec3, add, dot, norm, scale, sub, unit
from tests.strategies import floats, vectors

directions = vectors(1.0).filter(lambda v: norm(v) > 0.01).map(unit)


def surface(x: Vec3, n: Vec3, curvature: float = 0.0) -> LocalSurface:
    return LocalSurface(x, n, curvature, 0.004, 0.0, 0.0)


@given(vectors(0.2), directions, vectors(0.2))
def test_depth_below_a_plane(x: Vec3, n: Vec3, probe: Vec3) -> None:
    assert depth(surface(x, n), probe) == pytest.approx(dot(sub(x, probe), n), abs=1e-12)


@given(vectors(0.2), directions, vectors(0.2), floats(0.02, 2.0))
def test_depth_below_a_sphere_is_the_distance_to_its_skin(
    x: Vec3, n: Vec3, probe: Vec3, radius: float
) -> None:
    centre = sub(x, scale(n, radius))
    expected = radius - norm(sub(probe, centre))
    assert depth(surface(x, n, 1.0 / radius), probe) == pytest.approx(expected, abs=1e-9)


@given(directions, vectors(0.1))
def test_a_very_large_sphere_is_a_plane(n: Vec3, probe: Vec3) -> None:
    x = (0.0, 0.0, 0.0)
    flat, huge = depth(surface(x, n), probe), depth(surface(x, n, 1e-9), probe)
    assert huge == pytest.approx(flat, abs=1e-9)


@given(directions, vectors(0.1), floats(0.2, 2.0))
def test_the_normal_is_the_direction_in_which_depth_falls(
    n: Vec3, probe: Vec3, radius: float
) -> None:
    s = surface((0.0, 0.0, 0.0), n, 1.0 / radius)
    out, h = normal_at(s, probe), 1e-6
    fall = depth(s, probe) - depth(s, add(probe, scale(out, h)))
    assert fall / h == pytest.approx(1.0, abs=1e-4)
    assert norm(out) == pytest.approx(1.0)


@given(directions, directions, floats(-20.0, 20.0), st.floats(0.0, 1.0))
def test_a_blend_begins_and_ends_at_its_surfaces(
    a: Vec3, b: Vec3, curvature: float, s: float
) -> None:
    one, two = surface((0.0, 0.0, 0.0), a), surface((0.01, 0.0, 0.0), b, curvature)
    assert blend(one, two, 0.0) is one
    assert blend(one, two, 1.0) is two
    between = blend(one, two, s)
    assert math.isclose(norm(between.normal), 1.0, abs_tol=1e-9)
    assert between.x_free[0] == pytest.approx(0.01 * s)
