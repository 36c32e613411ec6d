from __future__ import annotations

from random import Random

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cohaptic.errors import LocalProtocolError
from cohaptic.protocol.neighbourhood import MAX_VERTICES, Neighbourhood
from cohaptic_server.bodies.balloon.balloon import Balloon
from cohaptic_server.bodies.touched_body import TouchedBody, vertex_compliance
from cohaptic_server.mesh.surface import SurfaceMesh
from cohaptic_server.numeric import Floats, Ints
from cohaptic_server.world.patch_geometry import (
    path_ahead,
    quantised,
)
from tests.examples_of_laws import examples
from tests.server.windows import choose as choose_window

RADIUS = 0.1  # m, of the balloon
OUT = np.array([1.0, 0.0, 0.0])
angles = st.floats(-np.pi, np.pi)


def gap(mesh: SurfaceMesh, chosen: Ints, at: Floats) -> float:
    """Distance from a point to the nearest vertex that was not chosen [m]."""
    left = np.setdiff1d(np.arange(len(mesh.vertices)), chosen)
    return float(np.linalg.norm(mesh.vertices[left] - at, axis=1).min())


def choose(body: Balloon, at: Floats, slide: Floats, horizon: float) -> Ints:
    """What a mesh patch carries of a balloon, as numbers of its touch mesh."""
    touched = TouchedBody(body)
    speeds, horizons = np.array([float(np.linalg.norm(slide))]), np.array([horizon])
    (length,), (width,) = path_ahead(touched.mesh, speeds, horizons)
    path = (slide, float(length), float(width))
    return choose_window(touched, at, at / RADIUS, 0.03, 0.03, path, MAX_VERTICES).touched


def one(vertices: Ints, displacement: Floats, c_ii: Floats) -> Neighbourhood:
    """One neighbourhood from its arrays."""
    (made,) = quantised(np.array([0, len(vertices)]), vertices, displacement, c_ii)
    return made


def cut(body: TouchedBody, displacement: Floats, touched: Ints) -> Neighbourhood:
    """The neighbourhood that a mesh patch would carry of these vertices."""
    return one(touched, displacement, body.touch_compliance[touched])


@given(angles, st.floats(-0.5, 0.9), angles, st.floats(0.0, 0.2), st.floats(0.0, 0.6))
@settings(max_examples=examples(40), deadline=None)
def test_the_chosen_are_round_the_contact_and_along_the_way(
    balloon: Balloon, angle: float, z: float, towards: float, speed: float, horizon: float
) -> None:
    mesh = balloon.mesh
    normal = np.array([np.cos(angle), np.sin(angle), z])
    normal /= np.linalg.norm(normal)
    first = np.cross(normal, [0.0, 0.0, 1.0])
    first /= np.linalg.norm(first)
    heading = np.cos(towards) * first + np.sin(towards) * np.cross(normal, first)
    at, slide = RADIUS * normal, speed * heading
    chosen = choose(balloon, at, slide, horizon)
    assert 0 < len(chosen) <= MAX_VERTICES
    assert (np.diff(chosen) > 0).all()
    # Whatever the slide_path, there is room for the client's weights on both sides of it.
    length = speed * horizon
    assert gap(mesh, chosen, at) > 0.027
    for fraction in (0.5, 1.0):
        a = fraction * length / RADIUS
        assert gap(mesh, chosen, RADIUS * (np.cos(a) * normal + np.sin(a) * heading)) > 0.027


def test_the_neighbourhood_says_where_its_vertices_are(balloon: Balloon) -> None:
    rng = np.random.default_rng(1)
    free = rng.uniform(-0.02, 0.02, balloon.mesh.vertices.shape)
    chosen = choose(balloon, RADIUS * OUT, np.zeros(3), 0.2)
    near = cut(TouchedBody(balloon), free[chosen], chosen)
    assert near.indices == tuple(chosen.tolist())
    assert near.scale * np.array(near.displacements) == pytest.approx(free[chosen], abs=1e-6)
    table = vertex_compliance(balloon)[chosen]
    assert near.c_scale * np.array(near.compliances) == pytest.approx(table, abs=1e-7)
    near.encode()


@given(
    st.lists(st.integers(0, 2**16 - 1), max_size=MAX_VERTICES, unique=True).map(sorted),
    st.floats(1e-9, 0.1),
    st.randoms(use_true_random=False),
)
def test_arrays_are_packed_as_numbers_are(vertices: list[int], size: float, random: Random) -> None:
    u = [[random.uniform(-size, size) for _ in range(3)] for _ in vertices]
    c = [random.uniform(0.0, size) for _ in vertices]
    packed = one(np.array(vertices, np.int64), np.array(u).reshape(-1, 3), np.array(c))
    assert packed == Neighbourhood.of(vertices, [(x, y, z) for x, y, z in u], c)


@pytest.mark.parametrize("vertices", [[3, 3], [7, 3], [1, 2**16], [-1, 2]])
def test_vertices_that_the_wire_cannot_number_are_refused(vertices: list[int]) -> None:
    with pytest.raises(ValueError, match="must rise to at most 65535"):
        one(np.array(vertices), np.zeros((2, 3)), np.zeros(2))


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("where", ["displacement", "compliance"])
def test_values_that_are_none_cost_their_user_and_not_the_tick(bad: float, where: str) -> None:
    u, c = np.full((2, 3), 0.1), np.full(2, 1e-3)
    if where == "displacement":
        u[1, 1] = bad
    else:
        c[1] = bad
    with pytest.raises(LocalProtocolError, match="of a neighbourhood is nan"):
        one(np.array([1, 5]), u, c).encode()


@pytest.mark.parametrize(("rows", "count"), [((2, 3), 3), ((3, 2), 3), ((3, 3), 2), ((3, 3), 4)])
def test_arrays_that_do_not_fit_are_refused(rows: tuple[int, int], count: int) -> None:
    with pytest.raises(ValueError, match="make no neighbourhood"):
        one(np.arange(3), np.zeros(rows), np.zeros(count))
