from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from cohaptic.control.friction import (
    MAX_FRICTION,
    NO_FRICTION,
    Compliance3,
    FrictionState,
    anchor_of,
    believed_shift,
    normal_shift,
    tangential,
    tangents,
    times,
    wedging,
)
from cohaptic.vec import ZERO, Vec3, add, dot, norm, scale, sub
from tests.shared.control.contacts import (
    compliances,
    forces,
    fractions,
    mus,
    normals,
    paths,
    rub,
    ways,
)
from tests.strategies import vectors


@given(normals)
def test_tangents_make_a_frame(n: Vec3) -> None:
    one, two = tangents(n)
    M = np.array([one, two, n])
    assert M @ M.T == pytest.approx(np.eye(3), abs=1e-12)
    assert np.linalg.det(M) == pytest.approx(1.0)


@given(st.lists(ways, min_size=1, max_size=30), normals, forces, compliances())
def test_a_contact_never_wedges(path: list[Vec3], n: Vec3, f_n: float, C: Compliance3) -> None:
    """Friction never takes the contact point back farther than the finger presses it in."""
    state = FrictionState()
    for way in path:
        state = rub(state, way, n, f_n, C, MAX_FRICTION)
        assert abs(normal_shift(state, n, C)) <= 0.9 * f_n * dot(n, times(C, n)) * (1.0 + 1e-9)


@given(ways, normals, compliances(), mus, st.floats(0.1, 10.0))
def test_a_law_of_any_gain_does_not_drive_its_own_force(
    way: Vec3, n: Vec3, C: Compliance3, mu: float, gain: float
) -> None:
    """Not where it is larger than 1 / C_nn either, as on a surface that turns faster than it."""
    k_h, depth = gain / dot(n, times(C, n)), 0.005
    state, f_n = FrictionState(), k_h * depth
    believed = believed_shift(n, C, k_h)
    before = f_n
    for _ in range(2000):
        state = rub(state, way, n, f_n, C, mu)
        way = ZERO  # after one stroke the finger rests
        before, f_n = f_n, k_h * max(0.0, depth - believed * normal_shift(state, n, C))
        assert f_n <= 10.0 * k_h * depth * (1.0 + 1e-9)
    assert abs(f_n - before) <= 1e-3 * k_h * depth


@given(normals, compliances(), st.floats(0.0, 1e4))
def test_a_law_no_stiffer_than_the_body_takes_the_whole_shift(
    n: Vec3, C: Compliance3, k_h: float
) -> None:
    gain = k_h * dot(n, times(C, n))
    assert believed_shift(n, C, k_h) == pytest.approx(min(1.0, 1.0 / max(gain, 1e-12)))
    assert 0.0 <= wedging(MAX_FRICTION, n, C, k_h) <= 0.9


@given(st.lists(ways, min_size=1, max_size=30), normals, forces, compliances(), mus, fractions)
def test_never_more_than_mu_times_the_normal_force_and_never_along_the_normal(
    path: list[Vec3], n: Vec3, f_n: float, C: Compliance3, mu: float, fraction: float
) -> None:
    state = FrictionState()
    for way in path:
        state = rub(state, way, n, f_n, C, mu, fraction)
        assert norm(state.force) <= mu * f_n * (1.0 + 1e-9)
        assert abs(dot(state.force, n)) <= 1e-9 * (1.0 + norm(state.force))
        assert abs(dot(state.stretch, n)) <= 1e-9


@given(vectors(0.0001), normals, forces, compliances())
def test_while_it_sticks_tip_and_contact_move_alike(
    way: Vec3, n: Vec3, f_n: float, C: Compliance3
) -> None:
    """s = -P C (n f_n + f_t)."""
    state = rub(FrictionState(touching=True), way, n, f_n, C, 1e6)
    # Where friction would lift the contact off it slips, whatever mu.
    pressed_in = times(C, scale(n, f_n))
    lifts = norm(sub(pressed_in, scale(n, dot(pressed_in, n))))
    assume(norm(state.force) < 0.89 * f_n * dot(pressed_in, n) / max(lifts, 1e-12))
    body = times(C, add(scale(n, f_n), state.force))
    for t in tangents(n):
        assert dot(state.stretch, t) == pytest.approx(-dot(body, t), abs=1e-12)
        assert dot(state.stretch, t) == pytest.approx(dot(way, t), abs=1e-12)


@given(vectors(0.0001), vectors(0.0001), normals, forces, compliances(), mus, fractions)
def test_after_a_slip_friction_holds_the_stretch(
    first: Vec3, second: Vec3, n: Vec3, f_n: float, C: Compliance3, mu: float, fraction: float
) -> None:
    """Standing still then changes nothing."""
    state = rub(FrictionState(), scale(first, 100.0), n, f_n, C, mu, fraction)
    again = rub(state, ZERO, n, f_n, C, mu, fraction)
    assert again.force == pytest.approx(state.force, rel=1e-6, abs=1e-9)
    assert again.stretch == pytest.approx(state.stretch, rel=1e-6, abs=1e-12)


@given(normals, forces, mus)
def test_an_isotropic_contact_is_pulled_back_straight(n: Vec3, f_n: float, mu: float) -> None:
    C = Compliance3(0.004, 0.004, 0.004, 0.0, 0.0, 0.0)
    one, _ = tangents(n)
    state = rub(FrictionState(), scale(one, 1.0), n, f_n, C, mu)
    assert state.force == pytest.approx(scale(one, -mu * f_n), rel=1e-9, abs=1e-9)
    assert normal_shift(state, n, C) == pytest.approx(0.0, abs=1e-12)


@given(st.lists(ways, min_size=2, max_size=30), normals, forces, compliances(), mus)
def test_a_closed_way_costs_energy(
    path: list[Vec3], n: Vec3, f_n: float, C: Compliance3, mu: float
) -> None:
    """Friction takes; over a way there and back the hand gets nothing (f_n held)."""
    state = rub(FrictionState(), ZERO, n, f_n, C, mu)
    start, work, unsure = state.force, 0.0, 0.0
    there_and_back = path + [scale(p, -1.0) for p in reversed(path)]
    for way in [scale(p, 0.1) for p in there_and_back for _ in range(10)]:
        before = state.force
        state = rub(state, way, n, f_n, C, mu)
        along = add(way, scale(n, -dot(way, n)))
        work -= 0.5 * dot(add(before, state.force), along)  # of the hand on the contact
        # Where it begins to slip within a step, the mean of both ends is not the mean of the way.
        unsure += 0.5 * norm(sub(state.force, before)) * norm(along)
    stored = max(C.xx, C.yy, C.zz) * 3.0 * (norm(start) + mu * f_n) ** 2
    assert work >= -stored - unsure


@pytest.mark.parametrize(
    "C",
    [
        Compliance3(0.0, 0.0, 0.004, 0.0, 0.0, 0.0),
        Compliance3(-0.004, -0.004, 0.004, 0.0, 0.0, 0.0),
        Compliance3(0.004, 0.004, 0.004, 0.01, 0.0, 0.0),
    ],
)
def test_a_matrix_that_is_no_compliance_gives_no_friction(C: Compliance3) -> None:
    """A server that is wrong, or worse: a spring that pushes on would make energy."""
    assert rub(NO_FRICTION, (0.001, 0.0, 0.0), (0.0, 0.0, 1.0), 1.0, C, 0.5) == NO_FRICTION


@given(paths, ways, normals, forces, compliances(), mus, st.floats(10.0, 1e4))
def test_no_direction_is_stiffer_than_the_device_renders(
    path: list[Vec3], way: Vec3, n: Vec3, f_n: float, C: Compliance3, mu: float, limit: float
) -> None:
    state = NO_FRICTION
    for step in [*path, ZERO]:
        state = rub(state, step, n, f_n, C, mu, max_stiffness=limit)
    after = rub(state, way, n, f_n, C, mu, max_stiffness=limit)
    assert norm(sub(after.force, state.force)) <= limit * norm(way) * (1.0 + 1e-6) + 1e-9


@given(ways, normals, compliances(), st.floats(10.0, 1e4))
def test_a_device_softer_than_the_object_is_used_up_to_its_limit(
    way: Vec3, n: Vec3, C: Compliance3, limit: float
) -> None:
    """In the stiffest direction along the surface the contact is as stiff as the device allows."""
    frame = tangents(n)
    along = [[dot(a, times(C, b)) for b in frame] for a in frame]
    eigenvalues, eigenvectors = np.linalg.eigh(along)
    one, two = (scale(t, float(x)) for t, x in zip(frame, eigenvectors[:, 0], strict=True))
    sticks = 1e9  # whatever the way
    state = rub(NO_FRICTION, ZERO, n, 1.0, C, sticks, max_stiffness=limit)
    step = scale(add(one, two), norm(way))
    after = rub(state, step, n, 1.0, C, sticks, max_stiffness=limit)
    expected = min(limit, 1.0 / eigenvalues[0]) * norm(way)
    # Beyond that friction would lift the contact off, and it slips whatever mu.
    pressed_in = times(C, n)
    lifts = norm(sub(pressed_in, scale(n, dot(pressed_in, n))))
    assume(expected < 0.89 * dot(pressed_in, n) / max(lifts, 1e-12))
    assert norm(sub(after.force, state.force)) == pytest.approx(expected, rel=1e-4, abs=1e-6)


@given(vectors(0.0001), vectors(0.01), vectors(0.003), normals, forces, compliances())
def test_a_contact_that_sticks_keeps_its_anchor(
    way: Vec3, tip: Vec3, others: Vec3, n: Vec3, f_n: float, C: Compliance3
) -> None:
    """Wherever the hand and the others take it."""
    start = FrictionState(touching=True)
    depth = 0.004
    before = anchor_of(start, tip, n, depth)
    state = rub(start, way, n, f_n, C, 1e6, material=others, max_change=1e6)
    pressed_in = times(C, scale(n, f_n))
    lifts = norm(sub(pressed_in, scale(n, dot(pressed_in, n))))
    assume(norm(state.force) < 0.89 * f_n * dot(pressed_in, n) / max(lifts, 1e-12))
    # The tip is as deep below the surface as before, less its own way out and the surface's.
    now = depth - dot(n, way) + dot(n, others)
    after = anchor_of(state, add(tip, way), n, now)
    assert before is not None
    assert after == pytest.approx(before, abs=1e-9)


@given(vectors(20.0), normals, forces)
def test_the_friction_of_a_client_is_bounded(force: Vec3, n: Vec3, f_n: float) -> None:
    along = tangential(force, n, f_n)
    assert abs(dot(along, n)) <= 1e-9 * (1.0 + norm(force))
    assert norm(along) <= MAX_FRICTION * f_n * (1.0 + 1e-9)
