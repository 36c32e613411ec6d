from __future__ import annotations

import functools
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cohaptic.errors import BodyError, SettingError
from cohaptic_server.bodies.body import Load
from cohaptic_server.bodies.solid.green_columns import GreenColumns
from cohaptic_server.bodies.solid.parts import stiffness_of
from cohaptic_server.bodies.solid.shape import SolidSettings
from cohaptic_server.bodies.solid.solid import Solid
from cohaptic_server.mesh.rigid_motions import rigid_motions
from cohaptic_server.numeric import Floats
from cohaptic_server.testing.blocks import block
from cohaptic_server.world.equilibrium import RestingHand, solve
from tests.examples_of_laws import examples
from tests.server.bodies.presses import press

directions = st.tuples(st.floats(-1, 1), st.floats(-1, 1), st.floats(0, 1)).filter(
    lambda v: np.linalg.norm(v) > 0.3
)
materials = st.tuples(st.integers(1, 2), st.sampled_from([0.0, 0.3, 0.45, 0.49]))


@functools.cache
def small(order: int = 2, nu: float = 0.45, cache: int = 2**28) -> Solid:
    """A block of 0.1 m whose foot is held, its vertices moved a little off their grid."""
    mesh = block((0.1, 0.08, 0.06), (3, 3, 2))
    mesh.vertices[:] += np.random.default_rng(1).uniform(-0.004, 0.004, mesh.vertices.shape)
    return Solid(mesh, mesh.vertices[:, 2] < 0.005, SolidSettings(1e4, nu, 0.015, order, cache))


@pytest.mark.parametrize("order", [1, 2])
def test_the_stiffness_is_symmetric_and_rigid_motions_cost_nothing(order: int) -> None:
    body = small(order)
    K, Z = stiffness_of(body.shape), rigid_motions(body.shape.nodes)
    assert abs(K - K.T).max() < 1e-12 * abs(K).max()
    assert np.abs(K @ Z).max() < 1e-12 * abs(K).max()


@pytest.mark.parametrize("order", [1, 2])
def test_a_uniform_strain_has_the_stress_of_hooke(order: int) -> None:
    """The patch test: nodes moved by a linear field are in balance, with the right energy."""
    body = small(order, 0.3)
    gradient = np.random.default_rng(2).normal(size=(3, 3))
    u = (body.shape.nodes @ gradient.T).ravel()
    strain = 0.5 * (gradient + gradient.T)
    lame, mu = 1e4 * 0.3 / (1.3 * 0.4), 1e4 / 2.6
    density = 0.5 * lame * np.trace(strain) ** 2 + mu * (strain * strain).sum()
    stored = 0.5 * u @ (stiffness_of(body.shape) @ u)
    assert stored == pytest.approx(density * body.shape.tets.volume, rel=1e-10)
    inside = np.setdiff1d(np.arange(len(body.shape.nodes)), body.shape.surface)
    force = (stiffness_of(body.shape) @ u).reshape(-1, 3)
    assert np.abs(force[inside]).max() < 1e-10 * np.abs(force).max()


@given(materials, st.lists(st.tuples(directions, st.floats(0.0, 5.0)), min_size=1, max_size=5))
@settings(max_examples=examples(30), deadline=None)
def test_contacts_obey_maxwell_and_betti_and_store_what_the_hands_did(
    material: tuple[int, float], presses: list[tuple[tuple[float, float, float], float]]
) -> None:
    body = small(*material)
    loads = [press(body, d, f) for d, f in presses]
    response = body.respond(loads)
    C = response.compliance
    assert np.abs(C - C.T).max() <= 1e-10 * np.abs(C).max()
    assert np.linalg.eigvalsh(C).min() > -1e-10 * np.abs(C).max()
    u = response.displacement
    work = sum(
        0.5 * load.force * float(load.weights @ (u[load.vertices] @ load.direction))
        for load in loads
    )
    assert response.energy == pytest.approx(work, rel=1e-9, abs=1e-15)
    assert np.abs(u[body.shape.fixed[body.shape.surface]]).max() == 0.0
    whole = full_solution(body, loads)
    # Columns are kept in single precision; each is off by at most half of its last digit.
    unit = np.abs(response.compliance).max(initial=0.0)
    limit = 1e-6 * unit * sum(load.force for load in loads)
    assert np.abs(whole[body.shape.surface] - u).max() <= limit + 1e-15
    K = stiffness_of(body.shape)
    stored = 0.5 * float(whole.ravel() @ (K @ whole.ravel()))
    assert response.energy == pytest.approx(stored, rel=1e-6, abs=1e-12)


def full_solution(body: Solid, loads: list[Load]) -> Floats:
    """All nodes under loads, by a dense solve that shares nothing with the factor."""
    force = np.zeros((len(body.shape.nodes), 3))
    for load in loads:
        fraction = load.force * load.weights[:, None] * load.direction
        np.add.at(force, body.shape.surface[load.vertices], fraction)
    free = np.repeat(~body.shape.fixed, 3)
    u = np.zeros(force.size)
    K = stiffness_of(body.shape)[free][:, free].toarray()
    u[free] = np.linalg.solve(K, force.ravel()[free])
    return u.reshape(-1, 3)


def test_a_small_cache_gives_the_same_and_stays_small(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("cohaptic_server.bodies.solid.column_store.MIN_CAPACITY", 10)
    roomy, tight = small(), small.__wrapped__()
    tight.columns = GreenColumns(
        tight.columns.factor, tight.shape.free_index, tight.mesh.vertices, 1
    )
    largest = 10
    assert tight.columns.store.capacity == largest
    for angle in np.linspace(0.0, 3.0, 7):
        loads = [press(b, (np.cos(angle), np.sin(angle), 0.5), 1.0) for b in (roomy, tight)]
        one, other = (b.respond([load]) for b, load in zip((roomy, tight), loads, strict=True))
        assert other.displacement == pytest.approx(one.displacement, rel=1e-6, abs=1e-12)
        largest = max(largest, len(loads[1].vertices))
        assert tight.columns.store.kept <= tight.columns.store.capacity == largest


@pytest.mark.parametrize(
    ("change", "word"),
    [
        ({"young": -1.0}, "Young's modulus"),
        ({"young": float("nan")}, "Young's modulus"),
        ({"nu": 0.5}, "Poisson's ratio is 0.5; it must be from 0 to 0.499"),
        ({"nu": -0.1}, "Poisson's ratio"),
        ({"order": 3}, "order of the elements is 3; it must be 1 or 2"),
        ({"contact_radius": -1.0}, "contact radius"),
        ({"cache": 1}, "cache"),
    ],
)
def test_absurd_materials_are_refused(change: dict[str, Any], word: str) -> None:
    with pytest.raises(SettingError, match=word):
        SolidSettings(**change)


@pytest.mark.parametrize(
    ("below", "beside", "word"),
    [
        (-1.0, 1.0, "would float away"),
        (1.0, 1.0, "all of the object is held"),
        (0.01, -0.04, "could still turn"),
    ],
)
def test_an_object_held_nowhere_or_everywhere_is_refused(
    below: float, beside: float, word: str
) -> None:
    mesh = block((0.1, 0.1, 0.1), (2, 2, 2))
    held = (mesh.vertices[:, 2] < below) & (mesh.vertices[:, 0] < beside)
    with pytest.raises(BodyError, match=word):
        Solid(mesh, held)


def test_two_hands_on_a_solid_feel_each_other() -> None:
    """Pressed beside each other they share a dent: each feels less than it would alone."""
    body = small()
    hands = [RestingHand((x, 0.0, 0.05), 200.0) for x in (-0.015, 0.015)]
    found = solve(body, hands)
    assert (found.force > 0.1).all()
    assert (found.felt_from_others < -0.01).all()
