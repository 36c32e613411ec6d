"""The surface of a neighbourhood, on meshes whose smooth surface is known."""

from __future__ import annotations

import math
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic.control.geometry import LocalSurface, Sight
from cohaptic.control.mesh_fit import RestSurface
from cohaptic.control.mesh_surface import MeshSurface
from cohaptic.vec import ZERO, Vec3, add, dot, norm, scale, sub, unit
from cohaptic_server.mesh.icosphere import icosphere
from tests.neighbourhoods import facts

RADIUS = 0.1  # m
C_II = 0.004  # m/N
OWN, BY_OTHERS = (0.5, 0.1, 0.0), (-0.001, 0.0, 0.002)  # N; m


_x, _faces = icosphere(3, RADIUS)
VERTICES = [(a, b, c) for a, b, c in _x.tolist()]
BALL = RestSurface(VERTICES, [(a, b, c) for a, b, c in _faces.tolist()])
IN_FRONT = [k for k, v in enumerate(VERTICES) if v[0] > 0.06]
angles = st.floats(-0.4, 0.4)


def direction(a: float, b: float) -> Vec3:
    return unit((math.cos(a) * math.cos(b), math.sin(a) * math.cos(b), math.sin(b)))


def surface(
    curvature: float = 0.0,
    x_free: Vec3 = (RADIUS, 0.0, 0.0),
    moved: Vec3 = (0.0, 0.0, 0.0),
    c_ii: dict[int, float] | None = None,
    chosen: list[int] = IN_FRONT,
) -> MeshSurface:
    """The front of the ball as seen from its foremost point."""
    base = LocalSurface(add(x_free, moved), (1.0, 0.0, 0.0), curvature, C_II, OWN, BY_OTHERS)
    known = dict.fromkeys(chosen, C_II) if c_ii is None else c_ii
    return MeshSurface(BALL, base, facts((k, *moved, known[k]) for k in chosen))


@given(angles, angles, st.floats(-0.02, 0.03))
def test_a_ball_is_a_ball_however_deep_the_probe_is(a: float, b: float, depth: float) -> None:
    out = direction(a, b)
    sight = surface().look(scale(out, RADIUS - depth))
    # Its vertices lie on the ball; the error is of third order between them: 4 um at the most
    # up to 10 mm off the surface, 25 um at 20 mm, where few vertices count and nothing is felt.
    assert sight.depth == pytest.approx(depth, abs=1e-5 if depth > -0.01 else 3e-5)
    assert dot(sight.normal, out) > 0.99999
    assert (sight.own_force, sight.u_others) == (OWN, BY_OTHERS)


@given(angles, angles, st.floats(-0.01, 0.02), st.tuples(*[st.floats(-0.02, 0.02)] * 3))
def test_a_surface_that_is_pushed_aside_is_evaluated_there(
    a: float, b: float, depth: float, by: Vec3
) -> None:
    out = direction(a, b)
    here = surface().look(scale(out, RADIUS - depth))
    there = surface(moved=by).look(add(scale(out, RADIUS - depth), by))
    assert there.depth == pytest.approx(here.depth, abs=1e-9)
    assert there.normal == pytest.approx(here.normal, abs=1e-9)


@given(st.floats(-0.002, 0.002), st.floats(0.5, 2.0))
def test_where_the_patch_was_made_depth_and_compliance_are_its_own(off: float, c: float) -> None:
    """Whatever the vertices say: the server found the contact with more than they tell."""
    there: Vec3 = (RADIUS + off, 0.0, 0.0)
    found = surface(x_free=there, c_ii=dict.fromkeys(IN_FRONT, c * C_II))
    assert found.look(there).depth == pytest.approx(0.0, abs=1e-12)
    assert found.look(there).c_ii == pytest.approx(C_II)
    # And with the same difference everywhere.
    out = direction(0.2, 0.1)
    assert found.look(scale(out, RADIUS)).depth == pytest.approx(off, abs=3e-5)
    assert found.look(scale(out, RADIUS)).c_ii == pytest.approx(C_II)


def test_as_far_as_others_moved_the_surface_the_compliance_is_the_contacts() -> None:
    """Their way is not the hand's: another place's compliance would change its force."""
    base = LocalSurface((RADIUS, 0.0, 0.0), (1.0, 0.0, 0.0), 0.0, C_II, OWN, BY_OTHERS)
    reported = facts((k, *ZERO, C_II * (1.0 + 5.0 * VERTICES[k][1])) for k in IN_FRONT)
    found = MeshSurface(BALL, base, reported, 0.02)
    for a in (-0.05, 0.0, 0.05):
        assert found.look(scale(direction(a, 0.0), RADIUS)).c_ii == pytest.approx(C_II, rel=0.002)
    far = found.look(scale(direction(0.3, 0.0), RADIUS)).c_ii
    assert far == pytest.approx(C_II * (1.0 + 5.0 * RADIUS * math.sin(0.3)), rel=0.005)


def slid(found: MeshSurface, a: tuple[float, float], b: tuple[float, float], n: int) -> list[Sight]:
    """Sights on the way from one direction to another, a centimetre deep."""
    ways = [(a[0] + (b[0] - a[0]) * i / n, a[1] + (b[1] - a[1]) * i / n) for i in range(n + 1)]
    return [found.look(scale(direction(*way), RADIUS - 0.01)) for way in ways]


@given(st.tuples(angles, angles), st.tuples(angles, angles))
def test_nothing_steps_on_the_way_over_edges_and_vertices(
    a: tuple[float, float], b: tuple[float, float]
) -> None:
    way = slid(surface(), a, b, 300)  # 0.3 mm at most from one to the next
    for before, after in pairwise(way):
        assert abs(after.depth - before.depth) < 2e-7
        assert norm(sub(after.normal, before.normal)) < 0.005


def test_it_is_smooth_to_the_first_derivative_also_where_it_ends() -> None:
    """Halved steps halve the change of the slope: there is no corner anywhere, nor a step."""
    found = surface(curvature=6.0)
    worst = list[float]()
    for n in (4000, 8000):
        depth = [s.depth for s in slid(found, (0.0, 0.0), (1.4, 0.05), n)]
        slope = [(b - a) * n for a, b in pairwise(depth)]
        worst.append(max(abs(b - a) for a, b in pairwise(slope)))
    assert worst[1] < 0.6 * worst[0]


@given(st.floats(1.6, math.pi), angles)
def test_beyond_the_neighbourhood_plane_or_sphere_takes_over(a: float, b: float) -> None:
    for curvature in (0.0, 8.0):
        probe = scale(direction(a, b), RADIUS - 0.005)
        base = LocalSurface((RADIUS, 0.0, 0.0), (1.0, 0.0, 0.0), curvature, C_II, OWN, BY_OTHERS)
        assert surface(curvature).look(probe) == base.look(probe)


@given(st.lists(st.tuples(angles, angles, st.floats(-0.02, 0.03)), min_size=2, max_size=6))
def test_earlier_evaluations_change_nothing(way: list[tuple[float, float, float]]) -> None:
    """The cache of near vertices changes no result."""
    one = surface()
    for a, b, depth in way:
        probe = scale(direction(a, b), RADIUS - depth)
        seen, fresh = one.look(probe), surface().look(probe)
        assert seen.depth == pytest.approx(fresh.depth, abs=1e-12)
        assert seen.normal == pytest.approx(fresh.normal, abs=1e-12)


@pytest.mark.parametrize("chosen", [[], IN_FRONT[:1], IN_FRONT[:3]])
def test_a_handful_of_vertices_is_no_surface(chosen: list[int]) -> None:
    probe: Vec3 = (RADIUS - 0.003, 0.001, 0.0)
    base = LocalSurface((RADIUS, 0.0, 0.0), (1.0, 0.0, 0.0), 0.0, C_II, OWN, BY_OTHERS)
    assert surface(chosen=chosen).look(probe) == base.look(probe)
