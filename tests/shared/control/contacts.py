"""Contacts with friction for tests: strategies, and paths that stick and slip."""

from __future__ import annotations

import math

import numpy as np
from hypothesis import strategies as st

from cohaptic.control.friction import (
    MAX_FRICTION,
    NO_FRICTION,
    Compliance3,
    FrictionState,
    friction_step,
)
from cohaptic.vec import ZERO, Vec3, unit
from tests.strategies import vectors

normals = vectors(1.0).map(unit)
ways = vectors(0.001)
mus = st.floats(0.05, MAX_FRICTION)
forces = st.floats(0.01, 10.0)
fractions = st.floats(0.2, 1.0)
paths = st.lists(ways, min_size=1, max_size=10)


@st.composite
def compliances(draw: st.DrawFn) -> Compliance3:
    """Symmetric positive definite, of 50 to 800 N/m or so."""
    A = np.random.default_rng(draw(st.integers(0, 2**32 - 1))).normal(size=(3, 4))
    C = (A @ A.T / 4.0 + 0.3 * np.eye(3)) * draw(st.floats(1.0 / 800.0, 1.0 / 50.0))
    return Compliance3(
        *(float(C[i, j]) for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)))
    )


def rub(
    state: FrictionState,
    way: Vec3,
    n: Vec3,
    f_n: float,
    C: Compliance3,
    mu: float,
    fraction: float = 1.0,
    material: Vec3 = ZERO,
    max_stiffness: float = math.inf,
    max_change: float = math.inf,
) -> FrictionState:
    """One period on material that is at rest, with a device that renders whatever it is told."""
    return friction_step(state, way, material, n, f_n, C, mu, fraction, max_stiffness, max_change)


def played(path: list[Vec3], n: Vec3, f_n: float, C: Compliance3, mu: float) -> FrictionState:
    """After a few periods of sticking and slipping."""
    state = NO_FRICTION
    for way in path:
        state = rub(state, way, n, f_n, C, mu)
    return state
