from __future__ import annotations

import functools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cohaptic_server.bodies.balloon.balloon import Balloon, BalloonSettings
from cohaptic_server.bodies.body import Response
from cohaptic_server.bodies.solid.shape import SolidSettings
from cohaptic_server.bodies.solid.solid import Solid
from cohaptic_server.bodies.viscous import Viscous, ViscousResponse
from cohaptic_server.testing.blocks import block
from tests.examples_of_laws import examples
from tests.server.bodies.presses import press

SMALL = BalloonSettings(subdivisions=2, contact_radius=0.03)


@functools.cache
def solid() -> Solid:
    mesh = block((0.1, 0.08, 0.06), (3, 3, 2))
    return Solid(mesh, mesh.vertices[:, 2] == 0.0, SolidSettings(2e4, 0.45, 0.015))


@functools.cache
def balloon() -> Balloon:
    return Balloon(SMALL)


def test_it_is_equation_9_with_b_o_in_proportion() -> None:
    """Beside the balloon's own damping, a hand that slides and lets go."""
    b = 1.5
    body, own = Viscous(balloon(), b), Balloon(SMALL, damping=b)
    response: Response | None = None
    expected: Response | None = None
    for tick in range(60):
        loads = [press(balloon(), (1.0, 0.03 * min(tick, 20), 0.2), 3.0 if tick < 30 else 0.0)]
        response, expected = body.respond(loads, response), own.respond(loads, expected)
        largest = np.abs(expected.displacement).max()
        # A thousandth of each load that was is let go of.
        assert response.displacement == pytest.approx(
            expected.displacement, abs=1e-4 + 0.01 * largest
        )
        assert response.compliance == pytest.approx(expected.compliance, rel=1e-9)
        assert response.energy == pytest.approx(expected.energy, rel=0.02, abs=1e-6)
    assert response is not None
    assert np.abs(response.displacement).max() < 1e-4


@given(st.floats(0.05, 2.0), st.floats(0.1, 5.0))
@settings(max_examples=examples(15), deadline=None)
def test_a_press_creeps_to_the_elastic_place(b: float, force: float) -> None:
    body, load = Viscous(solid(), b), press(solid(), (0.2, 0.1, 1.0), force)
    end = solid().respond([load])
    response: ViscousResponse | None = None
    reached: list[Response] = []
    for tick in range(1, 40):
        response = body.respond([load], response)
        reached.append(response)
        fraction = 1.0 - (b / (1.0 + b)) ** tick
        assert response.displacement == pytest.approx(fraction * end.displacement, abs=1e-12)
        assert response.energy == pytest.approx(fraction**2 * end.energy, rel=1e-9)
        assert len(response.carried) == 1
    assert response is not None
    assert response.compliance == pytest.approx(end.compliance)


def test_a_probe_that_lets_go_is_free_of_its_own_force_only() -> None:
    """x_free lacks C f of the present force; the remains of earlier forces stay in it."""
    body, load = Viscous(solid(), 1.0), press(solid(), (0.0, 0.0, 1.0), 2.0)
    every = np.arange(len(body.mesh.vertices))
    first = body.respond([load])
    end = solid().respond([load])
    free = first.without(slice(0, 1), np.array([2.0]), every)
    assert free == pytest.approx(first.displacement - end.displacement, abs=1e-9)
    assert first.displacement_of(every[:5]) == pytest.approx(first.displacement[:5])
