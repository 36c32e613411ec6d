from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic_server.bodies.body import LoadArrays
from cohaptic_server.bodies.modal.modal_body import step_of
from tests.server.bodies.modal.jelly import jelly, modes, solid
from tests.server.bodies.presses import press

frequencies = st.floats(1.0, 62.0)
dampings = st.floats(0.02, 0.95)
periods = st.floats(1.0 / 200.0, 0.1)


@given(frequencies, dampings, periods)
def test_a_tick_is_the_exact_free_motion(w: float, zeta: float, dt: float) -> None:
    """Two ticks are one of twice the length, and a short one obeys the equation of motion."""
    one, two = step_of(np.array([w]), zeta, dt)[0], step_of(np.array([w]), zeta, 2.0 * dt)[0]
    assert one @ one == pytest.approx(two, abs=1e-12)
    h = 1e-7
    rate = (step_of(np.array([w]), zeta, h)[0] - np.eye(2)) / h
    assert rate == pytest.approx(np.array([[0.0, w], [-w, -2.0 * zeta * w]]), rel=1e-3, abs=1e-3)


@given(frequencies, dampings, periods)
def test_its_energy_only_falls(w: float, zeta: float, dt: float) -> None:
    step = step_of(np.array([w]), zeta, dt)[0]
    assert np.linalg.norm(step, 2) <= 1.0 + 1e-12


def test_the_shapes_are_a_part_of_the_compliance() -> None:
    """C less that of the modes is that of a stiffer body: no force moves against itself."""
    rng = np.random.default_rng(0)
    ways = rng.normal(size=(12, 3)) + np.array([0.0, 0.0, 0.5])
    loads = [press(solid(), way, 0.0) for way in ways]
    C = solid().respond(loads).compliance
    along = jelly().along(LoadArrays.of(loads))
    assert np.linalg.eigvalsh(C - along @ along.T)[0] >= -1e-5 * np.abs(C).max()
    assert modes().shapes.shape[1:] == solid().mesh.vertices.shape
