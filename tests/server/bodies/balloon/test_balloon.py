from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cohaptic.errors import SettingError
from cohaptic_server.bodies.balloon.balloon import Balloon, BalloonSettings, inflate
from cohaptic_server.mesh.rigid_motions import rigid_motions
from tests.examples_of_laws import examples
from tests.server.bodies.presses import press

directions = st.tuples(st.floats(-1, 1), st.floats(-1, 1), st.floats(-0.4, 1)).filter(
    lambda v: np.linalg.norm(v) > 0.3
)


def test_the_unheld_balloon_can_be_moved_and_turned_at_no_cost() -> None:
    """Translation stores no energy (science 3.6); neither does rotation, as nothing is held."""
    inflated = inflate(BalloonSettings(subdivisions=2))
    K, Z = inflated.stiffness, rigid_motions(inflated.x)
    assert np.abs(K @ Z).max() < 1e-10 * abs(K).max()


def test_the_pressure_is_that_of_laplace(balloon: Balloon) -> None:
    """p = 2 T / R with tension T = mu h (1 - s^-6); the facets take a little."""
    s = balloon.settings
    expected = 2.0 * s.mu_h * (1.0 - s.stretch**-6) / s.radius
    assert balloon.inflated.pressure == pytest.approx(expected, rel=0.02)


@given(st.lists(st.tuples(directions, st.floats(0.0, 5.0)), min_size=1, max_size=5))
@settings(max_examples=examples(30), deadline=None)
def test_contacts_obey_maxwell_and_betti_and_store_what_the_hands_did(
    presses: list[tuple[tuple[float, float, float], float]],
) -> None:
    body = _shared_balloon()
    loads = [press(body, d, f) for d, f in presses]
    response = body.respond(loads)
    C = response.compliance
    assert np.abs(C - C.T).max() <= 1e-12 * np.abs(C).max()
    assert np.linalg.eigvalsh(C).min() > -1e-12
    # Work of the hands on the way in: half of force times displacement, for a linear body.
    u = response.displacement
    work = sum(
        0.5 * load.force * float(load.weights @ (u[load.vertices] @ load.direction))
        for load in loads
    )
    assert response.energy == pytest.approx(work, rel=1e-9, abs=1e-15)
    K = body.inflated.stiffness
    stored = 0.5 * float(u.ravel() @ (K @ u.ravel()))
    assert response.energy == pytest.approx(stored, rel=1e-6, abs=1e-12)


@given(st.lists(st.tuples(directions, st.floats(0.0, 5.0)), min_size=1, max_size=5))
@settings(max_examples=examples(30), deadline=None)
def test_water_is_incompressible_and_the_base_is_held(
    presses: list[tuple[tuple[float, float, float], float]],
) -> None:
    body = _shared_balloon()
    u = body.respond([press(body, d, f) for d, f in presses]).displacement
    moved = body.inflated.volume_gradient * u.ravel()
    # C is kept in single precision.
    assert abs(moved.sum()) <= np.finfo(np.float32).eps * np.abs(moved).sum()
    assert np.abs(u[body.mesh.vertices[:, 2] < -0.085]).max() == 0.0


def test_pressing_one_side_pushes_the_other_out(balloon: Balloon) -> None:
    """Science 3.2: opposite contacts of a balloon held at its base are coupled, and negatively."""
    C = balloon.respond([press(balloon, (1, 0, 0), 0), press(balloon, (-1, 0, 0), 0)]).compliance
    assert -0.8 < C[0, 1] / C[0, 0] < -0.5


def test_stiffness_does_not_jump_from_vertex_to_vertex(balloon: Balloon) -> None:
    """K_o along an arc from one vertex over faces and edges to the next ones."""
    stiffness: list[float] = []
    for angle in np.linspace(0.0, 0.4, 161):
        load = press(balloon, (np.cos(angle), np.sin(angle), 0.0), 0.0)
        stiffness.append(1.0 / balloon.respond([load]).compliance[0, 0])
    steps = np.abs(np.diff(stiffness)) / np.mean(stiffness)
    assert steps.max() < 0.005
    assert np.ptp(stiffness) < 0.05 * np.mean(stiffness)


def test_contact_stiffness_converges_with_the_mesh() -> None:
    """Compliance of a contact, less that of a wider one: the part that is local to the contact.

    The rest depends on which vertices the base holds, which differs from mesh to mesh.
    """

    def local(subdivisions: int) -> float:
        body = Balloon(BalloonSettings(subdivisions=subdivisions, base=0.5))

        def c(radius: float) -> float:
            load = press(body, (0.2, 0.1, 1.0), 0.0, radius)
            return float(body.respond([load]).compliance[0, 0])

        return c(0.04) - c(0.06)

    coarse, middle, fine = local(1), local(2), local(3)
    assert abs(fine - middle) < 0.5 * abs(middle - coarse)


@pytest.mark.parametrize(
    "change",
    [
        {"radius": -1.0},
        {"stretch": 0.9},
        {"mu_h": float("nan")},
        {"base": 2.0},
        {"subdivisions": 9},
    ],
)
def test_absurd_balloons_are_refused(change: dict[str, Any]) -> None:
    with pytest.raises(SettingError, match="balloon"):
        BalloonSettings(**change)


def _shared_balloon(cache: list[Balloon] = []) -> Balloon:  # noqa: B006
    """Hypothesis and fixtures do not mix; this one is built once."""
    if not cache:
        cache.append(Balloon(BalloonSettings(subdivisions=2)))
    return cache[0]
