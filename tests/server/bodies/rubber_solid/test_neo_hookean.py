from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic_server.bodies.hyperelastic import NeoHookean
from cohaptic_server.bodies.rubber_solid.element_loops import stresses
from cohaptic_server.bodies.solid.shape import Moduli
from cohaptic_server.numeric import Floats

RUBBER = NeoHookean.of(Moduli.uniform(1, 2e4, 0.45))
seeds = st.integers(0, 2**32 - 1)


def evaluate(F: Floats) -> tuple[float, Floats]:
    """Energy density and first Piola-Kirchhoff stress of one deformation gradient."""
    P, J = F.reshape(1, 9, 1).copy(), np.empty((1, 1))
    part = stresses(P, np.ones((1, 1)), RUBBER.mu, RUBBER.lame, J, np.empty(9))
    energy = part - float(RUBBER.mu[0] + 0.5 * RUBBER.lame[0]) * math.log(J[0, 0])
    return energy, P.reshape(3, 3)


def energy(F: Floats) -> float:
    return evaluate(F)[0]


def deformed(seed: int, size: float = 0.4) -> Floats:
    """Away from flat: a random deformation gradient whose J is positive."""
    rng = np.random.default_rng(seed)
    F = np.eye(3) + rng.uniform(-size, size, (3, 3))
    return np.asarray(F if np.linalg.det(F) > 0.1 else np.eye(3) + 0.3 * (F - np.eye(3)))


@given(seeds)
def test_stress_is_the_derivative_of_energy(seed: int) -> None:
    F, h = deformed(seed), 1e-5
    P = evaluate(F)[1]
    for i in range(3):
        for p in range(3):
            step = np.zeros((3, 3))
            step[i, p] = h
            slope = (energy(F + step) - energy(F - step)) / (2.0 * h)
            assert P[i, p] == pytest.approx(slope, abs=1e-6 * np.abs(P).max() + 1e-3)


@given(seeds, seeds)
def test_turning_a_body_stores_nothing_and_turns_its_stress(seed: int, turn: int) -> None:
    F = deformed(seed)
    Q, _ = np.linalg.qr(np.random.default_rng(turn).normal(size=(3, 3)))
    Q *= np.sign(np.linalg.det(Q))
    assert energy(Q @ F) == pytest.approx(energy(F), rel=1e-9, abs=1e-9)
    assert energy(Q) == pytest.approx(0.0, abs=1e-9)
    P, turned = (evaluate(G)[1] for G in (F, Q @ F))
    assert turned == pytest.approx(Q @ P, abs=1e-9 * np.abs(P).max() + 1e-9)


@given(seeds)
def test_small_strains_are_hookes(seed: int) -> None:
    L = np.random.default_rng(seed).normal(size=(3, 3)) * 1e-5
    strain = 0.5 * (L + L.T)
    hooke = RUBBER.lame[0] * np.trace(strain) * np.eye(3) + 2.0 * RUBBER.mu[0] * strain
    P = evaluate(np.eye(3) + L)[1]
    assert P == pytest.approx(hooke, abs=1e-3 * np.abs(hooke).max())
