from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cohaptic_server.bodies.balloon.balloon import Balloon, BalloonSettings
from cohaptic_server.bodies.balloon.rubber_balloon import (
    RubberBalloon,
    RubberResponse,
)
from cohaptic_server.bodies.body import Load
from cohaptic_server.bodies.newton import CHORD, MAX_MOVE
from cohaptic_server.mesh.enclosed_volume import volume
from cohaptic_server.numeric import Floats
from cohaptic_server.testing.check_body import depth, settled
from tests.examples_of_laws import examples
from tests.server.bodies.presses import check_derivatives, press

SMALL = BalloonSettings(subdivisions=2, contact_radius=0.03)
DEEPEST = 10.0  # N, the largest force of the demo's simulated devices

directions = st.tuples(st.floats(-1, 1), st.floats(-1, 1), st.floats(-0.4, 1)).filter(
    lambda v: np.linalg.norm(v) > 0.3
)
presses = st.lists(st.tuples(directions, st.floats(0.0, 5.0)), min_size=1, max_size=3)


@pytest.fixture(scope="module")
def small() -> RubberBalloon:
    return RubberBalloon(SMALL)


@pytest.fixture(scope="module")
def rubber() -> RubberBalloon:
    """The balloon that is served."""
    return RubberBalloon()


def positions(body: RubberBalloon, response: RubberResponse) -> Floats:
    return np.asarray(body.mesh.vertices + response.displacement)


def lost(body: RubberBalloon, response: RubberResponse) -> float:
    """Change of volume, relative."""
    return abs(volume(positions(body, response), body.mesh.faces) / body.volume - 1.0)


def test_without_forces_it_rests_and_answers_as_the_linear_balloon(rubber: RubberBalloon) -> None:
    loads = [press(rubber, (1, 0, 0), 0.0), press(rubber, (0, 1, 0.3), 0.0)]
    response, twin = rubber.respond(loads), Balloon().respond(loads)
    assert np.abs(response.displacement).max() < 1e-10
    single = np.finfo(np.float32).eps * np.abs(twin.fields).max()  # in which the twin keeps C
    assert response.fields == pytest.approx(twin.fields, abs=single)
    assert response.compliance == pytest.approx(twin.compliance, abs=single)
    assert rubber.respond([]).compliance.shape == (0, 0)


def test_it_agrees_with_its_linear_twin_at_a_thousandth_of_strain(rubber: RubberBalloon) -> None:
    """A press that strains no triangle beyond 0.1 % answers within 1 %."""
    twin = Balloon()
    load = press(rubber, (1, 0, 0), 0.02)
    response, linear = settled(rubber, [load]), twin.respond([load])
    x, at_rest = response.iterate.state.strain, rubber.respond([]).iterate.state.strain
    strain = np.abs(np.sqrt(x[:, 8:] / at_rest[:, 8:]) - 1.0).max()
    assert 1e-4 < strain < 1e-3
    gap = np.linalg.norm(response.displacement - linear.displacement)
    assert gap < 0.01 * np.linalg.norm(linear.displacement)
    assert response.compliance == pytest.approx(linear.compliance, rel=0.01)
    assert response.energy == pytest.approx(linear.energy, rel=0.01)


@pytest.mark.parametrize("direction", [(1, 0, 0), (0, 0, 1), (-0.5, 0.5, -0.3)])
def test_the_volume_is_constant_under_the_deepest_press(
    rubber: RubberBalloon, direction: object
) -> None:
    """In every tick, on the way too; and the base is held."""
    load, response = press(rubber, direction, DEEPEST), None
    for _ in range(8):
        response = rubber.respond([load], response)
        assert lost(rubber, response) < 1e-9
    assert response is not None
    assert depth(load, response) > 0.015
    held = rubber.mesh.vertices[:, 2] < -0.085
    assert np.abs(response.displacement[held]).max() == 0.0


@given(presses)
@settings(max_examples=examples(8), deadline=None)
def test_fields_and_compliance_are_derivatives_by_the_forces(
    small: RubberBalloon, hands: list[tuple[tuple[float, float, float], float]]
) -> None:
    """K_o is the tangent at the present state (science 3.6)."""
    loads = [press(small, d, f) for d, f in hands]
    at = settled(small, loads)
    C = at.compliance
    assert np.abs(C - C.T).max() == 0.0
    assert np.linalg.eigvalsh(C).min() > -1e-12
    check_derivatives(small, loads, at)


@pytest.mark.parametrize("force", [2.0, DEEPEST])
def test_the_hands_work_is_the_energy_stored(small: RubberBalloon, force: float) -> None:
    """Loaded in 40 steps: trapezium of force over depth. And given back on the way out."""
    place, response = press(small, (1, 0, 0), 0.0), None
    work, last, energies = 0.0, (0.0, 0.0), list[float]()
    ramp = np.linspace(0.0, force, 41).tolist()
    for f in (*ramp, *ramp[::-1]):
        load = Load(place.vertices, place.weights, place.direction, f)
        response = settled(small, [load], response)
        moved = depth(place, response)
        work += 0.5 * (f + last[0]) * (moved - last[1])
        last = (f, moved)
        energies.append(response.energy)
        assert response.energy == pytest.approx(work, rel=5e-3, abs=1e-6)
    assert max(energies) > 0.001
    assert energies[-1] == pytest.approx(0.0, abs=1e-12)


@given(presses)
@settings(max_examples=examples(8), deadline=None)
def test_a_warm_start_ends_where_a_cold_one_does(
    small: RubberBalloon, hands: list[tuple[tuple[float, float, float], float]]
) -> None:
    loads = [press(small, d, f) for d, f in hands]
    cold = settled(small, loads)
    warm = settled(small, loads, settled(small, [press(small, (0.2, 1, 0.4), 4.0)]))
    assert warm.displacement == pytest.approx(cold.displacement, abs=1e-8)
    assert warm.compliance == pytest.approx(cold.compliance, rel=1e-6, abs=1e-12)


@pytest.mark.parametrize("force", [50.0, 300.0])
@pytest.mark.parametrize("direction", [(1, 0, 0), (0, 0, 1), (0.1, 0.2, -0.6)])
def test_no_force_makes_it_jump_or_fail(
    small: RubberBalloon, force: float, direction: object
) -> None:
    """Five and thirty times the force of a device: at once, kept, and released at once."""
    response = small.respond([])
    for f in [force] * 25 + [0.0] * 60:
        was = response.displacement
        response = small.respond([press(small, direction, f)], response)
        assert np.isfinite(response.displacement).all()
        assert np.isfinite(response.fields).all()
        assert np.abs(response.displacement - was).max() < MAX_MOVE * 1.05 + CHORD
        assert lost(small, response) < 1e-9
        assert response.compliance[0, 0] > 0.0
    assert np.abs(response.displacement).max() < 1e-6


def test_it_never_goes_up_on_its_way(small: RubberBalloon) -> None:
    """Under loads that stay, the energy of rubber and loads falls from tick to tick."""
    loads = [press(small, (1, 0, 0), 40.0), press(small, (0, 0, 1), 15.0)]
    response, heights = small.respond([]), list[float]()
    for _ in range(30):
        response = small.respond(loads, response)
        heights.append(response.energy - sum(one.force * depth(one, response) for one in loads))
    assert np.diff(heights).max() < 1e-12
    assert heights[-1] < heights[0]
