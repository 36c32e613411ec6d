from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic.control.geometry import (
    LocalSurface,
    Sight,
    blend,
    depth,
    difference,
    normal_at,
    shift,
)
from cohaptic.vec import ZERO, Vec3, add, norm, scale, sub, unit
from tests.strategies import floats, vectors

directions = vectors(1.0).filter(lambda v: norm(v) > 0.01).map(unit)


def surface(x: Vec3, n: Vec3, curvature: float = 0.0) -> LocalSurface:
    return LocalSurface(x, n, curvature, 0.004, ZERO, ZERO)


@given(vectors(0.2), directions, vectors(0.2), floats(0.02, 2.0))
def test_depth_below_a_sphere_is_the_distance_to_its_skin(
    x: Vec3, n: Vec3, probe: Vec3, radius: float
) -> None:
    centre = sub(x, scale(n, radius))
    expected = radius - norm(sub(probe, centre))
    assert depth(surface(x, n, 1.0 / radius), probe) == pytest.approx(expected, abs=1e-9)


@given(directions, vectors(0.1), floats(0.2, 2.0))
def test_the_normal_is_the_direction_in_which_depth_falls(
    n: Vec3, probe: Vec3, radius: float
) -> None:
    s = surface((0.0, 0.0, 0.0), n, 1.0 / radius)
    out, h = normal_at(s, probe), 1e-6
    fall = depth(s, probe) - depth(s, add(probe, scale(out, h)))
    assert fall / h == pytest.approx(1.0, abs=1e-4)
    assert norm(out) == pytest.approx(1.0)


sights = st.builds(
    Sight,
    st.floats(-0.02, 0.02),
    directions,
    st.floats(1e-4, 0.02),
    vectors(10.0),
    vectors(0.02),
)


@given(sights, sights, st.floats(0.0, 1.0))
def test_a_blend_begins_and_ends_at_its_sights(a: Sight, b: Sight, s: float) -> None:
    assert blend(a, b, 0.0) is a
    assert blend(a, b, 1.0) is b
    between = blend(a, b, s)
    assert math.isclose(norm(between.normal), 1.0, abs_tol=1e-9)
    assert between.depth == pytest.approx(a.depth + s * (b.depth - a.depth), abs=1e-15)
    for name in ("own_force", "u_others"):
        one, two = getattr(a, name), getattr(b, name)
        expected = add(scale(one, 1.0 - s), scale(two, s))
        assert getattr(between, name) == pytest.approx(expected, abs=1e-12)


@given(sights, sights)
def test_a_difference_of_sights_turns_the_one_into_the_other(a: Sight, b: Sight) -> None:
    moved = shift(b, difference(a, b))
    assert moved.normal == pytest.approx(a.normal, abs=1e-9)
    for name in ("depth", "c_ii", "own_force", "u_others"):
        assert getattr(moved, name) == pytest.approx(getattr(a, name), abs=1e-12)
    assert shift(b, None) is b
