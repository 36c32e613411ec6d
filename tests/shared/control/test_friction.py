from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic.control.friction import (
    MAX_FRICTION,
    Compliance3,
    FrictionState,
    friction_step,
    normal_shift,
    tangential,
    tangents,
)
from cohaptic.vec import ZERO, Vec3, add, dot, norm, scale, sub, unit
from tests.strategies import vectors

normals = vectors(1.0).map(unit)
ways = vectors(0.001)
mus = st.floats(0.05, MAX_FRICTION)
forces = st.floats(0.01, 10.0)
shares = st.floats(0.2, 1.0)


@st.composite
def compliances(draw: st.DrawFn) -> Compliance3:
    """Symmetric positive definite, of 50 to 800 N/m or so."""
    A = np.random.default_rng(draw(st.integers(0, 2**32 - 1))).normal(size=(3, 4))
    C = (A @ A.T / 4.0 + 0.3 * np.eye(3)) * draw(st.floats(1.0 / 800.0, 1.0 / 50.0))
    return Compliance3(
        *(float(C[i, j]) for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)))
    )


@given(normals)
def test_tangents_make_a_frame(n: Vec3) -> None:
    one, two = tangents(n)
    M = np.array([one, two, n])
    assert M @ M.T == pytest.approx(np.eye(3), abs=1e-12)
    assert np.linalg.det(M) == pytest.approx(1.0)


@given(st.lists(ways, min_size=1, max_size=30), normals, forces, compliances(), mus, shares)
def test_never_more_than_mu_times_the_normal_force_and_never_along_the_normal(
    path: list[Vec3], n: Vec3, f_n: float, C: Compliance3, mu: float, share: float
) -> None:
    state = FrictionState()
    for way in path:
        state = friction_step(state, way, n, f_n, C, mu, share)
        assert norm(state.force) <= mu * f_n * (1.0 + 1e-9)
        assert abs(dot(state.force, n)) <= 1e-9 * (1.0 + norm(state.force))
        assert abs(dot(state.stretch, n)) <= 1e-9


@given(vectors(0.0001), normals, forces, compliances())
def test_while_it_sticks_tip_and_contact_move_alike(
    way: Vec3, n: Vec3, f_n: float, C: Compliance3
) -> None:
    """s = -P C (n f_n + f_t)."""
    state = friction_step(FrictionState(), way, n, f_n, C, 1e6)
    body = C.times(add(scale(n, f_n), state.force))
    for t in tangents(n):
        assert dot(state.stretch, t) == pytest.approx(-dot(body, t), abs=1e-12)
        assert dot(state.stretch, t) == pytest.approx(dot(way, t), abs=1e-12)


@given(vectors(0.0001), vectors(0.0001), normals, forces, compliances(), mus, shares)
def test_after_a_slip_the_stretch_is_what_friction_holds(
    first: Vec3, second: Vec3, n: Vec3, f_n: float, C: Compliance3, mu: float, share: float
) -> None:
    """Standing still then changes nothing."""
    state = friction_step(FrictionState(), scale(first, 100.0), n, f_n, C, mu, share)
    again = friction_step(state, ZERO, n, f_n, C, mu, share)
    assert again.force == pytest.approx(state.force, rel=1e-6, abs=1e-9)
    assert again.stretch == pytest.approx(state.stretch, rel=1e-6, abs=1e-12)


@given(normals, forces, mus)
def test_an_isotropic_contact_is_pulled_back_straight(n: Vec3, f_n: float, mu: float) -> None:
    C = Compliance3(0.004, 0.004, 0.004, 0.0, 0.0, 0.0)
    one, _ = tangents(n)
    state = friction_step(FrictionState(), scale(one, 1.0), n, f_n, C, mu)
    assert state.force == pytest.approx(scale(one, -mu * f_n), rel=1e-9, abs=1e-9)
    assert normal_shift(state, n, C) == pytest.approx(0.0, abs=1e-12)


@given(st.lists(ways, min_size=2, max_size=30), normals, forces, compliances(), mus)
def test_a_closed_way_costs_energy(
    path: list[Vec3], n: Vec3, f_n: float, C: Compliance3, mu: float
) -> None:
    """Friction takes; over a way there and back the hand gets nothing (f_n held)."""
    state = friction_step(FrictionState(), ZERO, n, f_n, C, mu)
    start, work, unsure = state.force, 0.0, 0.0
    there_and_back = path + [scale(p, -1.0) for p in reversed(path)]
    for way in [scale(p, 0.1) for p in there_and_back for _ in range(10)]:
        before = state.force
        state = friction_step(state, way, n, f_n, C, mu)
        along = add(way, scale(n, -dot(way, n)))
        work -= 0.5 * dot(add(before, state.force), along)  # of the hand on the contact
        # Where it begins to slip within a step, the mean of both ends is not the mean of the way.
        unsure += 0.5 * norm(sub(state.force, before)) * norm(along)
    stored = max(C.xx, C.yy, C.zz) * 3.0 * (norm(start) + mu * f_n) ** 2
    assert work >= -stored - unsure


def test_without_contact_or_friction_there_is_none() -> None:
    C = Compliance3(0.004, 0.004, 0.004, 0.0, 0.0, 0.0)
    stuck = FrictionState((0.001, 0.0, 0.0), (1.0, 0.0, 0.0))
    assert friction_step(stuck, ZERO, (0.0, 0.0, 1.0), 0.0, C, 0.5) == FrictionState()
    assert friction_step(stuck, ZERO, (0.0, 0.0, 1.0), 1.0, C, 0.0) == FrictionState()


@given(vectors(20.0), normals, forces)
def test_what_a_client_calls_friction_is_bounded(force: Vec3, n: Vec3, f_n: float) -> None:
    along = tangential(force, n, f_n)
    assert abs(dot(along, n)) <= 1e-9 * (1.0 + norm(force))
    assert norm(along) <= MAX_FRICTION * f_n * (1.0 + 1e-9)
