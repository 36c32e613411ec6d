"""The hands condition of science 3.8, tau >= theta m: where it is proved and where it is a rule."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic.control.stability.lag_choice import FRACTION, coupling_radius, lag_needed
from cohaptic.control.stability.single_contact import Floats

THETA = 0.12  # s
W: Floats = np.concatenate([np.linspace(1e-2, 60.0, 6000), np.geomspace(60.02, 2000.0, 1500)])


def hand_loop(mass: Floats, damping: Floats, stiffness: Floats, gain: Floats) -> np.ndarray:
    """H of each hand at the frequencies W, shape (frequencies, hands)."""
    w = W[:, None]
    own = stiffness - mass * w * w + 1j * damping * w
    return np.asarray(own / (own + gain))


def swings(S: Floats, delays: Floats, lag: float, H: np.ndarray) -> bool:
    """Whether a room of moving hands is unstable: det(I + G H S) goes round 0 (Nyquist)."""
    G = H * np.exp(-1j * W[:, None] * delays) / (1.0 + 1j * W[:, None] * lag)
    phase = np.unwrap(np.angle(np.linalg.det(np.eye(len(S)) + G[:, :, None] * S)))
    return abs(float(phase[-1] - phase[0])) > 0.5 * math.pi


def draw(rng: np.random.Generator, softest: float) -> tuple[Floats, Floats, np.ndarray]:
    """S, delays and hands of a room; the hands as heavy for their damping as theta allows."""
    n = int(rng.integers(2, 9))
    A = rng.normal(size=(n, int(rng.integers(2, 3 * n))))
    if rng.random() < 0.6:
        A = np.abs(A)
    C = A @ A.T + 1e-2 * np.eye(n)
    scale = 1.0 / np.sqrt(np.diag(C))
    S = C * np.outer(scale, scale) - np.eye(n)
    spread = 1.0 if rng.random() < 0.5 else 0.05
    delays = rng.uniform(0.03, 0.6) * rng.uniform(spread, 1.0, n)
    damping = np.exp(rng.uniform(math.log(0.4), math.log(20.0), n))
    mass = rng.uniform(0.5, 1.0, n) * THETA * damping
    stiffness = rng.uniform(softest, 300.0, n)
    gain = np.exp(rng.uniform(math.log(20.0), math.log(2000.0), n))
    if rng.random() < 0.5:
        mass, damping, stiffness, gain = (
            np.full(n, x[0]) for x in (mass, damping, stiffness, gain)
        )
    return S, delays, hand_loop(mass, damping, stiffness, gain)


@given(st.floats(0.01, 2.0), st.floats(0.1, 20.0), st.floats(0.0, 2000.0), st.floats(0.0, 1e4))
def test_a_hand_raises_the_gain_by_its_mass_over_its_damping_at_most(
    mass: float, damping: float, stiffness: float, gain: float
) -> None:
    H = hand_loop(*(np.array([x]) for x in (mass, damping, stiffness, gain)))[:, 0]
    assert (np.abs(H) <= np.sqrt(1.0 + (mass / damping * W) ** 2) * (1.0 + 1e-9)).all()


def test_below_one_the_rule_holds_for_all_hands_and_delays() -> None:
    """Proved: tau = theta m; and it is needed for some, or the rule would be none."""
    rng = np.random.default_rng(0)
    swung = 0
    for _ in range(150):
        S, delays, H = draw(rng, 0.0)
        m = rng.uniform(0.3, 0.999)
        S *= m / coupling_radius(S)
        assert not swings(S, delays, THETA * m, H)
        swung += swings(S, delays, 0.1 * THETA * m, H)
    assert swung > 30


def test_above_one_both_rules_together_hold_for_hands_with_some_stiffness() -> None:
    """Not proved; these are the rooms of science 3.8."""
    rng = np.random.default_rng(1)
    swung = tried = 0
    while tried < 150:
        S, delays, H = draw(rng, 20.0)
        m = coupling_radius(S)
        if m <= 1.0:
            continue
        tried += 1
        edge = lag_needed(m, float(delays.max()))
        assert not swings(S, delays, max(edge / FRACTION, THETA * m), H)
        swung += swings(S, delays, 1.001 * edge, H)
    assert swung > 3  # the theorem's edge alone is that of hands held still


@pytest.mark.parametrize(("longer", "unstable"), [(1.0, True), (1.1, False)])
def test_above_one_the_rule_is_no_theorem(longer: float, unstable: bool) -> None:
    """Like hands without any stiffness of their own, at their worst gain."""
    m, T, mass, damping, gain = 1.31, 0.28, 0.438, 3.65, 26.0
    S = m / 2.0 * (np.ones((3, 3)) - np.eye(3))
    H = hand_loop(*(np.full(3, x) for x in (mass, damping, 0.0, gain)))
    lag = longer * max(lag_needed(m, T) / FRACTION, THETA * m)
    assert mass / damping == pytest.approx(THETA)
    assert swings(S, np.full(3, T), lag, H) is unstable
