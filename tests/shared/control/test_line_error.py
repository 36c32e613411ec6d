"""The error of vertices below a contact, where the server's patch is right."""

from __future__ import annotations

import math
from array import array
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic.control.geometry import LocalSurface
from cohaptic.control.mesh_fit import RestSurface
from cohaptic.control.mesh_surface import MeshSurface
from cohaptic.vec import ZERO, Vec3, add, dot, norm, scale, sub, unit
from cohaptic_server.mesh.icosphere import icosphere
from tests.neighbourhoods import facts

RADIUS = 0.1  # m
C_II = 0.004  # m/N
CORNER = unit((1.0, 0.0, 1.0))
CLOSE = math.cos(math.radians(0.3))


_x, _faces = icosphere(3, RADIUS)
BALL_VERTICES = [(a, b, c) for a, b, c in _x.tolist()]
BALL = RestSurface(BALL_VERTICES, [(a, b, c) for a, b, c in _faces.tolist()])
IN_FRONT = [k for k, v in enumerate(BALL_VERTICES) if v[0] > 0.06]


def bumpy(
    seed: int, tilt: Vec3, off: float, curvature: float, fraction: float = 0.5
) -> tuple[MeshSurface, LocalSurface]:
    """A ball whose vertices lie up to 2 mm off it, and a contact that is not quite theirs.

    The vertices have `fraction` of its compliance, as on limbs, which bend to one side more easily.
    """
    moved = np.random.default_rng(seed).uniform(-0.002, 0.002, (len(IN_FRONT), 3)).tolist()
    normal = unit(add((1.0, 0.0, 0.0), tilt))
    base = LocalSurface((RADIUS + off, 0.001, -0.002), normal, curvature, C_II, ZERO, ZERO)
    reported = facts((k, *by, fraction * C_II) for k, by in zip(IN_FRONT, moved, strict=True))
    return MeshSurface(BALL, base, reported), base


def sheet(u: list[float], at: list[Vec3], y: list[float]) -> tuple[RestSurface, list[Vec3]]:
    """A curve of the plane y = 0 drawn along y, as a grid of triangles."""
    vertices = [(x, w, z) for w in y for x, _, z in at]
    m = len(u)
    corners = [(j * m + i, j * m + i + 1) for j in range(len(y) - 1) for i in range(m - 1)]
    faces = [f for a, b in corners for f in ((a, b, b + m), (a, b + m, a + m))]
    return RestSurface(vertices, faces), vertices


def rim() -> MeshSurface:
    """The top and a side of a block, with a contact on their edge that looks out between them."""
    u = [0.004 * i for i in range(-12, 13)]
    at: list[Vec3] = [(min(0.0, t), 0.0, min(0.0, -t)) for t in u]
    rest, vertices = sheet(u, at, [0.004 * j for j in range(-12, 13)])
    base = LocalSurface(ZERO, CORNER, 20.0, C_II, ZERO, ZERO)
    return MeshSurface(rest, base, facts((k, 0, 0, 0, C_II) for k in range(len(vertices))))


tilts = st.tuples(*[st.floats(-0.15, 0.15)] * 3)
made = {
    "seed": st.integers(0, 99),
    "tilt": tilts,
    "off": st.floats(-0.003, 0.003),
    "curvature": st.sampled_from([0.0, 9.0]),
}


@given(**made, fraction=st.sampled_from([0.02, 0.5, 40.0]), depth=st.floats(-0.01, 0.02))
def test_below_the_contact_the_patch_is_right(
    seed: int, tilt: Vec3, off: float, curvature: float, fraction: float, depth: float
) -> None:
    """Exactly at the points, and to a micrometre between them."""
    found, base = bumpy(seed, tilt, off, curvature, fraction)
    sight = found.look(sub(base.x_free, scale(base.normal, depth)))
    assert sight.depth == pytest.approx(depth, abs=1e-6)
    assert dot(sight.normal, base.normal) > CLOSE
    assert sight.c_ii == pytest.approx(C_II, rel=0.02)


@given(**made, beside=st.tuples(*[st.floats(-0.03, 0.03)] * 3))
def test_beside_the_contact_the_compliance_is_at_most_four_times_another_or_that_of_vertices(
    seed: int, tilt: Vec3, off: float, curvature: float, beside: Vec3
) -> None:
    rng = np.random.default_rng(seed)
    base = bumpy(seed, tilt, off, curvature)[1]
    compliances = (C_II * 10.0 ** rng.uniform(-3.0, 3.0, len(IN_FRONT))).tolist()
    reported = facts((k, 0.0, 0.0, 0.0, c) for k, c in zip(IN_FRONT, compliances, strict=True))
    sight = MeshSurface(BALL, base, reported).look(add(base.x_free, beside))
    assert min(0.2499 * C_II, *compliances) < sight.c_ii < 4.001 * C_II


@given(**made, a=st.floats(-math.pi, math.pi))
def test_nothing_steps_on_the_way_out_to_the_vertices(
    seed: int, tilt: Vec3, off: float, curvature: float, a: float
) -> None:
    """From the line, where they are believed or not, to where they are, at varying depth."""
    found, base = bumpy(seed, tilt, off, curvature)
    slope = list[list[float]]()
    for n in (400, 800):
        sights = [
            found.look(
                add(
                    sub(base.x_free, scale(base.normal, 0.012 * i / n)),
                    (0.0, 0.03 * math.cos(a) * i / n, 0.03 * math.sin(a) * i / n),
                )
            )
            for i in range(n + 1)
        ]
        slope.append([(q.depth - p.depth) * n for p, q in pairwise(sights)])
        assert max(norm(sub(p.normal, q.normal)) for p, q in pairwise(sights)) < 20.0 / n
    # Once continuously differentiable: steps of half the size change the slope by half.
    coarse, fine = (max(abs(q - p) for p, q in pairwise(s)) for s in slope)
    assert fine < 0.75 * coarse + 1e-6


@pytest.mark.parametrize("depth", [0.002, 0.006, 0.012, 0.02])
def test_deep_below_an_edge_the_depth_is_the_patchs(depth: float) -> None:
    """There the mean over the vertices is up to a tenth short of it."""
    assert rim().look(scale(CORNER, -depth)).depth == pytest.approx(depth, abs=1e-6)


@given(st.floats(-math.pi, math.pi), st.floats(0.0, 0.001), st.floats(0.0, 0.015))
def test_near_the_line_vertices_of_another_normal_are_not_believed(
    a: float, beside: float, depth: float
) -> None:
    """Theirs turns as the server's does not, and the difference comes back late: a hand swings."""
    tilt = (0.0, 0.22 * math.cos(a), 0.22 * math.sin(a))  # 12 degrees
    found, base = bumpy(0, tilt, 0.0, 9.0)
    side = unit((-tilt[1], math.cos(a), math.sin(a)))
    probe = add(sub(base.x_free, scale(base.normal, depth)), scale(side, beside))
    sight, on_sphere = found.look(probe), base.look(probe)
    # Of a fit that turns by 20 % more or less, 1 mm beside the line a tenth would be seen.
    assert norm(sub(sight.normal, on_sphere.normal)) < 0.02 * norm(
        sub((1.0, 0.0, 0.0), base.normal)
    )
    assert sight.depth == pytest.approx(on_sphere.depth, abs=1e-5)


def test_vertices_that_look_the_other_way_are_not_believed() -> None:
    """Of a thin part, those of the far side: a probe through it would be pulled to them."""
    u = [0.004 * i for i in range(-10, 11)]
    rest, vertices = sheet(u, [(-t, 0.0, -0.003) for t in u], u)
    base = LocalSurface(ZERO, (0.0, 0.0, 1.0), 0.0, C_II, ZERO, ZERO)
    found = MeshSurface(rest, base, facts((k, 0, 0, 0, C_II) for k in range(len(vertices))))
    for probe in ((0.0, 0.0, -0.004), (0.005, 0.002, -0.001), (0.012, 0.0, -0.006)):
        assert found.look(probe) == base.look(probe)


TUBE = 0.02  # m, its radius


@pytest.fixture(scope="module")
def tube() -> tuple[RestSurface, array[float]]:
    """A limb along y, of elements of 4 mm."""
    m, n = 32, 40
    turns = [2.0 * math.pi * i / m for i in range(m)]
    vertices = [
        (TUBE * math.sin(a), 0.004 * (j - n // 2), TUBE * math.cos(a))
        for j in range(n)
        for a in turns
    ]
    corners = [(m * j + i, m * j + (i + 1) % m) for j in range(n - 1) for i in range(m)]
    faces = [f for a, b in corners for f in ((a, b, b + m), (a, b + m, a + m))]
    return RestSurface(vertices, faces), facts((k, 0, 0, 0, C_II) for k in range(m * n))


@given(
    curvature=st.sampled_from([0.0, 0.5 / TUBE, 1.0 / TUBE]),
    round_it=st.floats(-1.8, 1.8),
    along=st.floats(-0.06, 0.06),
    depth=st.floats(0.0, 0.004),
)
def test_a_finger_far_from_its_contact_is_as_deep_as_the_vertices_say(
    tube: tuple[RestSurface, array[float]],
    curvature: float,
    round_it: float,
    along: float,
    depth: float,
) -> None:
    """Round a limb a plane says far too deep, and along it a sphere says far outside.

    A finger that slides at 0.2 m/s is 0.1 m from its contact at 250 ms each way.
    """
    base = LocalSurface((0.0, 0.0, TUBE), (0.0, 0.0, 1.0), curvature, C_II, ZERO, ZERO)
    out = (math.sin(round_it), 0.0, math.cos(round_it))
    sight = MeshSurface(tube[0], base, tube[1]).look(
        add(scale(out, TUBE - depth), (0.0, along, 0.0))
    )
    assert sight.depth == pytest.approx(depth, abs=1e-4)
    assert dot(sight.normal, out) > CLOSE


@given(
    thickness=st.floats(0.002, 0.006),
    fraction=st.floats(1.0, 2.5),
    beside=st.floats(0.0, 0.025),
    a=st.floats(-math.pi, math.pi),
)
def test_a_finger_through_a_sheet_is_not_pulled_to_the_far_side(
    thickness: float, fraction: float, beside: float, a: float
) -> None:
    """However far beside its contact: pressed so far, the sheet has moved with it."""
    u = [0.004 * i for i in range(-10, 11)]
    sides: list[Vec3] = [(t, 0.0, 0.0) for t in u] + [(-t, 0.0, -thickness) for t in u]
    rest, vertices = sheet([0.0] * len(sides), sides, u)
    base = LocalSurface(ZERO, (0.0, 0.0, 1.0), 0.0, C_II, ZERO, ZERO)
    found = MeshSurface(rest, base, facts((k, 0, 0, 0, C_II) for k in range(len(vertices))))
    probe = (beside * math.cos(a), beside * math.sin(a), -fraction * thickness)
    sight = found.look(probe)
    assert sight.depth == pytest.approx(fraction * thickness, abs=1e-4)
    assert sight.normal[2] > 0.9


@pytest.mark.parametrize("curvature", [0.0, 5.0])
@pytest.mark.parametrize("depth", [0.002, 0.004])
def test_nothing_steps_where_a_finger_leaves_the_vertices(depth: float, curvature: float) -> None:
    """Off the edge of a block, 30 mm from the contact: steep, but a ramp."""
    u = [0.004 * i for i in range(-16, 13)]
    at: list[Vec3] = [(min(0.0, t), 0.0, min(0.0, -t)) for t in u]
    rest, vertices = sheet(u, at, [0.004 * j for j in range(-12, 13)])
    base = LocalSurface((-0.03, 0.0, 0.0), (0.0, 0.0, 1.0), curvature, C_II, ZERO, ZERO)
    found = MeshSurface(rest, base, facts((k, 0, 0, 0, C_II) for k in range(len(vertices))))

    def felt(x: float) -> float:
        return max(0.0, found.look((x, 0.0003, -depth)).depth)

    begin, way = -0.03, 0.06
    for n in (4000, 200):
        x = [begin + way * i / n for i in range(n + 1)]
        steps = [abs(felt(b) - felt(a)) for a, b in pairwise(x)]
        k = steps.index(max(steps))
        begin, way = x[k], way / n
    assert max(steps) < 2e-5
