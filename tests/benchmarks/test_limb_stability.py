"""The parts of `limb_stability.py` that its figures rest on."""

from __future__ import annotations

import numpy as np
import pytest

import limb_stability
from cohaptic.control.law import Law
from limbs import LIMBS, draw


@pytest.mark.parametrize("radius", [0.8, 1.05])
def test_the_spectral_radius_of_a_known_system_is_found(radius: float) -> None:
    """A swinging mode and a fast one, of six inputs and twelve outputs."""
    rng = np.random.default_rng(3)
    angle = 0.7
    A = np.zeros((3, 3))
    A[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    A[:2, :2] *= radius
    A[2, 2] = 0.5
    B, C = rng.normal(size=(3, 6)), rng.normal(size=(12, 3))
    Y = np.array([C @ np.linalg.matrix_power(A, k) @ B for k in range(60)])
    root = max(limb_stability.realised(Y), key=abs)
    assert abs(root) == pytest.approx(radius, rel=1e-6)
    assert abs(np.angle(root)) == pytest.approx(angle, rel=1e-6)


def test_a_twin_goes_on_as_the_session_does_and_leaves_it_alone() -> None:
    body = LIMBS["limb"]()
    session = limb_stability.joined(body, draw(body, 1), 0.02, Law.PREDICTIVE)
    session.run(1.9)
    one, other = limb_stability.twin(session), limb_stability.twin(session)
    limb_stability._device(other.users["hand 0"]).push = (1e-4, 0.0, 0.0)
    for each in (other, one, session):  # the pushed one first: it must not disturb the rest
        each.run(0.3)
    assert (limb_stability.signals(one) == limb_stability.signals(session)).all()
    assert (limb_stability.signals(other) != limb_stability.signals(session)).any()
    assert max(session.users["hand 0"].force) > 0.01


@pytest.mark.parametrize("name", list(LIMBS))
def test_hands_press_a_limb_from_both_sides(name: str) -> None:
    body = LIMBS[name]()
    for seed in range(5):
        one, other = draw(body, seed)
        assert np.dot(one.place.inward, other.place.inward) < 0.0
        for press in (one, other):
            at = np.linalg.norm(body.mesh.vertices - press.place.point, axis=1).argmin()
            assert not body.shape.held[at]
