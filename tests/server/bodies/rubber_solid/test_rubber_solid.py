from __future__ import annotations

import functools

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from cohaptic.errors import BodyError
from cohaptic_server.bodies.body import Load
from cohaptic_server.bodies.newton import MAX_MOVE
from cohaptic_server.bodies.rubber_solid.rubber_solid import RubberSolid, RubberSolidResponse
from cohaptic_server.bodies.solid.shape import SolidSettings
from cohaptic_server.bodies.solid.solid import Solid
from cohaptic_server.mesh.surface import pressure
from cohaptic_server.mesh.tetrahedra import TetMesh
from cohaptic_server.testing.blocks import block
from cohaptic_server.testing.check_body import depth, settled
from tests.examples_of_laws import examples
from tests.server.bodies.presses import check_derivatives, press
from tests.server.bodies.rubber_solid.inversion import least_volume

directions = st.tuples(st.floats(-1, 1), st.floats(-1, 1), st.floats(0, 1)).filter(
    lambda v: np.linalg.norm(v) > 0.3
)
presses = st.lists(st.tuples(directions, st.floats(0.0, 2.0)), min_size=1, max_size=3)


def skewed() -> TetMesh:
    """A block of 0.1 m, its vertices moved a little off their grid."""
    mesh = block((0.1, 0.08, 0.06), (3, 3, 2))
    mesh.vertices[:] += np.random.default_rng(1).uniform(-0.004, 0.004, mesh.vertices.shape)
    return mesh


@functools.cache
def small(order: int = 2, nu: float = 0.45, damping: float = 0.0) -> RubberSolid:
    mesh = skewed()
    held = mesh.vertices[:, 2] < 0.005
    return RubberSolid(mesh, held, SolidSettings(2e4, nu, 0.015, order), damping=damping)


@functools.cache
def linear(order: int = 2, nu: float = 0.45) -> Solid:
    mesh = skewed()
    return Solid(mesh, mesh.vertices[:, 2] < 0.005, SolidSettings(2e4, nu, 0.015, order))


def greatest_strain(body: RubberSolid, response: RubberSolidResponse) -> float:
    F = body.rubber.gradients_at(response.iterate.state)
    strain = 0.5 * (F + F.swapaxes(2, 3)) - np.eye(3)
    return float(np.abs(np.linalg.eigvalsh(strain)).max())


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("nu", [0.0, 0.3, 0.49])
def test_at_rest_it_answers_as_the_linear_solid(order: int, nu: float) -> None:
    body, twin = small(order, nu), linear(order, nu)
    loads = [press(body, (0, 0, 1), 0.0), press(body, (1, 0.2, 0.3), 0.0)]
    response, expected = body.respond(loads), twin.respond(loads)
    assert np.abs(response.displacement).max() == 0.0
    assert response.energy == 0.0
    # The twin keeps its columns in single precision.
    assert response.compliance == pytest.approx(expected.compliance, rel=1e-5)
    assert body.respond([]).compliance.shape == (0, 0)
    for k in (0, 20, len(body.mesh.vertices) - 1):
        at = body.mesh.vertices[k]
        load = Load(
            *pressure(body.mesh, at, body.contact_radius, body.mesh.normals[k]),
            -body.mesh.normals[k],
            0.0,
        )
        own = body.respond([load]).compliance[0, 0]
        assert body.vertex_compliance()[k] == pytest.approx(own, rel=1e-6, abs=1e-12)


@pytest.mark.parametrize("order", [1, 2])
def test_it_agrees_with_its_linear_twin_at_a_thousandth_of_strain(order: int) -> None:
    body, twin = small(order), linear(order)
    trial = greatest_strain(body, settled(body, [press(body, (0.2, 0.1, 1), 0.01)]))
    load = press(body, (0.2, 0.1, 1), 0.01 * 1e-3 / trial)
    response, expected = settled(body, [load]), twin.respond([load])
    assert greatest_strain(body, response) == pytest.approx(1e-3, rel=0.01)
    gap = np.linalg.norm(response.displacement - expected.displacement)
    assert gap < 0.01 * np.linalg.norm(expected.displacement)
    assert response.compliance == pytest.approx(expected.compliance, rel=0.01)
    assert response.energy == pytest.approx(expected.energy, rel=0.01)


@given(presses)
@settings(max_examples=examples(8), deadline=None)
def test_fields_and_compliance_are_derivatives_by_the_forces(
    hands: list[tuple[tuple[float, float, float], float]],
) -> None:
    """K_o is the tangent at the present state (science 3.6)."""
    body = small()
    loads = [press(body, d, f) for d, f in hands]
    at = settled(body, loads)
    C = at.compliance
    assert np.abs(C - C.T).max() <= 1e-8 * np.abs(C).max()
    assert np.linalg.eigvalsh(C).min() > -1e-10 * np.abs(C).max()
    check_derivatives(body, loads, at)


@given(st.integers(0, 2**32 - 1), st.sampled_from([1, 2]))
@settings(max_examples=examples(20), deadline=None)
def test_a_rigid_motion_stores_no_energy_and_takes_no_force(seed: int, order: int) -> None:
    """Also a large one."""
    rubber, x = small(order).rubber, small(order).shape.nodes
    rng = np.random.default_rng(seed)
    Q, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    Q *= np.sign(np.linalg.det(Q))
    state = rubber.state(x @ Q.T + rng.normal(size=3))
    assert state is not None
    volume = small(order).shape.tets.volume
    assert abs(state.energy) < 1e-10 * rubber.material.mu[0] * volume
    assert np.abs(state.internal_force).max() < 1e-10 * rubber.material.mu[0] * volume ** (2 / 3)


@given(st.integers(0, 2**32 - 1), st.sampled_from([1, 2]))
@settings(max_examples=examples(10), deadline=None)
def test_forces_and_tangent_are_derivatives_of_energy(seed: int, order: int) -> None:
    """Far from rest; the tangent is tested through its solutions."""
    body = small(order)
    rubber, rest = body.rubber, body.shape.nodes
    rng = np.random.default_rng(seed)
    bend = 0.1 * rng.normal(size=(3, 3))
    moved = np.zeros_like(rest)
    free = ~body.shape.fixed
    moved[free] = rest[free] @ bend + 1e-3 * rng.normal(size=(int(free.sum()), 3))
    x = rest + 0.5 * moved
    state = rubber.state(x)
    assume(state is not None)  # a few of these draws turn an element inside out
    assert state is not None
    way, h = np.zeros_like(rest), 1e-6
    way.reshape(-1)[rubber.dof] = rng.normal(size=rubber.dof.size)
    up, down = rubber.state(x + h * way), rubber.state(x - h * way)
    assert up is not None
    assert down is not None
    slope = (up.energy - down.energy) / (2.0 * h)
    assert (state.internal_force * way).sum() == pytest.approx(slope, rel=1e-5)
    stiff = ((up.internal_force - down.internal_force) / (2.0 * h)).reshape(-1)[rubber.dof]
    try:
        solver, found = rubber.factor_tangent(state, 0.0, stiff[None])
    except BodyError:
        return  # indefinite so far from rest: it has no factor
    found = found[0]
    assert solver.step(stiff[None])[0] == pytest.approx(found, abs=1e-3 * np.abs(found).max())
    expected = way.reshape(-1)[rubber.dof]
    assert np.linalg.norm(found - expected) < 1e-3 * np.linalg.norm(expected)


@pytest.mark.parametrize("force", [1.0, 5.0])
def test_the_hands_work_is_the_energy_stored(force: float) -> None:
    """Loaded in 40 steps: trapezium of force over depth. And given back on the way out."""
    body = small()
    place, response = press(body, (0.3, 0.1, 1), 0.0), None
    work, last, energies = 0.0, (0.0, 0.0), list[float]()
    ramp = np.linspace(0.0, force, 41).tolist()
    for f in (*ramp, *ramp[::-1]):
        load = Load(place.vertices, place.weights, place.direction, f)
        response = settled(body, [load], response)
        moved = depth(place, response)
        work += 0.5 * (f + last[0]) * (moved - last[1])
        last = (f, moved)
        energies.append(response.energy)
        assert response.energy == pytest.approx(work, rel=5e-3, abs=1e-7)
    assert max(energies) > 1e-4
    assert energies[-1] == pytest.approx(0.0, abs=1e-12)


@given(presses)
@settings(max_examples=examples(8), deadline=None)
def test_a_warm_start_ends_where_a_cold_one_does(
    hands: list[tuple[tuple[float, float, float], float]],
) -> None:
    body = small()
    loads = [press(body, d, f) for d, f in hands]
    cold = settled(body, loads)
    warm = settled(body, loads, settled(body, [press(body, (0.2, 1, 0.4), 2.0)]))
    assert warm.displacement == pytest.approx(cold.displacement, abs=1e-8)
    assert warm.compliance == pytest.approx(cold.compliance, rel=1e-6, abs=1e-12)


@pytest.mark.usefixtures("kernels")
@given(
    st.lists(
        st.tuples(directions, st.floats(0.0, 3.0).map(lambda x: 10.0**x)), min_size=1, max_size=3
    ),
    st.integers(5, 40),
)
@settings(max_examples=examples(12), deadline=None)
def test_no_push_turns_an_element_inside_out_and_it_comes_back(
    hands: list[tuple[tuple[float, float, float], float]], ticks: int
) -> None:
    """At once, up to a thousand newtons; held; gone at once."""
    body = small()
    limit = 0.2 * body.mesh.size
    loads, response = [press(body, d, f) for d, f in hands], body.respond([])
    for tick in range(ticks + 250):
        was = response
        response = body.respond(loads if tick < ticks else loads[:0], was)
        state = response.iterate.state
        assert np.isfinite(response.displacement).all()
        assert np.isfinite(response.fields).all()
        assert np.abs(response.displacement - was.displacement).max() < min(MAX_MOVE, 1.05 * limit)
        if tick % 5 == 0:
            assert least_volume(body.shape, state.x) > 0.0
        if tick < ticks:
            assert (np.diag(response.compliance) > 0.0).all()
        elif np.abs(response.displacement).max() < 1e-8:
            break
    assert np.abs(response.displacement).max() < 1e-8


@pytest.mark.parametrize("order", [1, 2])
def test_what_is_inside_out_or_no_number_is_no_state(order: int) -> None:
    rubber, x = small(order).rubber, small(order).shape.nodes
    assert rubber.state(x) is not None
    for bad in (x * [1.0, 1.0, -1.0], x * [1.0, 1.0, 0.0], np.full_like(x, np.nan)):
        assert rubber.state(np.asarray(bad)) is None
    assert rubber.state(x, 1.0 + 1e-9) is None
