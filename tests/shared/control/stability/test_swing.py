from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic.control.stability.anticipation import (
    Gains,
    anticipated,
    gains_left,
    hand_class,
    hand_factor,
    row_gain,
)
from cohaptic.control.stability.swing import Swing, felt_fraction, shown_gain, worst_row_gain
from cohaptic_server.bodies.modal.modal_body import step_of, swing_of
from cohaptic_server.numeric import Floats
from tests.shared.control.stability.test_anticipation import coupling

DT = 1.0 / 60.0  # s


def swing(w: float, damping: float) -> Swing:
    at = np.geomspace(0.1 * w, np.pi / DT, 400)
    return Swing(at, swing_of(np.array([w]), damping, DT, at)[0])


@given(st.floats(1e-2, 1e2), st.floats(-1e2, 1e2), st.floats(0.0, 1.0), st.floats(1e-2, 1e3))
def test_no_hand_answers_what_it_is_shown_by_more(
    p: float, stiff: float, fraction: float, stiffness: float
) -> None:
    q, x = max(stiff, -p), fraction * stiffness / p
    H = abs((q + 1j) / (q + x + 1j))
    assert H * H <= float(shown_gain(np.array(p), stiffness)) * (1.0 + 1e-9)
    assert H * H <= float(shown_gain(np.array(p))) * (1.0 + 1e-9)


@given(st.floats(1e-2, 1e2), st.floats(1e-2, 1e3))
def test_a_hand_does_answer_so(p: float, stiffness: float) -> None:
    """The bound is that of some hand."""
    q = -np.linspace(0.0, p, 401)[:, None]
    x = np.linspace(0.0, min(stiffness / p, 2.0 * p), 401)
    H2 = (q * q + 1.0) / ((x + q) ** 2 + 1.0)
    assert float(H2.max()) == pytest.approx(float(shown_gain(np.array(p), stiffness)), rel=0.02)


def _quotient(gains: Gains, x: Floats, y: Floats) -> Floats:
    """The square of a hand's gain in its row, as 3.13 derives it."""
    alpha, beta, c = gains.apart, gains.together, gains.held
    over = beta * beta * x * x + (c * y - alpha * x) ** 2 + c * c
    return np.asarray(over / ((x + y) ** 2 + 1.0))


@given(
    st.floats(0.0, 5.0),
    st.floats(0.0, 0.999),
    st.floats(1e-2, 1e2),
    st.floats(1e-2, 1e3),
    st.floats(0.0, 1.0),
    st.floats(0.0, 1.0) | st.floats(-1e2, 0.0),
)
def test_no_hand_of_the_class_has_more_gain_in_its_row(
    positive: float, negative: float, p: float, stiffness: float, fraction: float, mass: float
) -> None:
    """Whatever its mass, its own spring and K are."""
    gains = gains_left(positive, -negative)
    x, y = np.array(fraction * stiffness / p), np.array(-mass * p)
    limit = float(worst_row_gain(gains, np.array(p), stiffness))
    assert float(_quotient(gains, x, y)) <= limit * (1.0 + 1e-9) + 1e-12
    assert limit <= float(worst_row_gain(gains, np.array(p))) * (1.0 + 1e-9) + 1e-12
    assert limit >= float(row_gain(gains, np.array(p), stiffness)) * (1.0 - 1e-9) - 1e-12


@given(st.floats(0.0, 5.0), st.floats(0.0, 0.999), st.floats(0.1, 10.0), st.floats(0.1, 1e2))
def test_some_hand_of_the_class_has_it(
    positive: float, negative: float, p: float, stiffness: float
) -> None:
    gains = gains_left(positive, -negative)
    y = -np.linspace(0.0, p, 401)[:, None]
    x = np.linspace(0.0, stiffness / p, 401)
    limit = float(worst_row_gain(gains, np.array(p), stiffness))
    x = np.concatenate([x, np.minimum(x[-1], np.geomspace(1e-2, 1e2, 401))])
    assert float(_quotient(gains, x, y).max()) == pytest.approx(limit, rel=0.02, abs=1e-9)


@given(
    st.floats(0.0, 5.0),
    st.floats(0.0, 0.9),
    st.floats(1.0, 60.0),
    st.floats(0.02, 0.9),
    st.floats(0.0, 3.0),
    st.floats(0.0, 8.0),
    st.floats(10.0, 2000.0),
)
def test_with_it_the_gain_of_the_loop_is_below_one(
    positive: float,
    negative: float,
    w: float,
    damping: float,
    weight: float,
    budget: float,
    stiffest: float,
) -> None:
    gains, (theta, chi) = gains_left(positive, -negative), hand_class(budget, stiffest)
    tau = 1.3 * theta * hand_factor(gains, chi)
    what = swing(w, damping)
    g = felt_fraction(gains, theta, chi, tau, weight, what)
    assert 0.0 <= g <= 1.0
    p = theta * what.frequency
    loop = np.sqrt(worst_row_gain(gains, p, chi))
    loop += g * weight * (1.0 + gains.apart) * what.size * np.sqrt(shown_gain(p, chi))
    assert (loop < np.sqrt(1.0 + (tau * what.frequency) ** 2) + 5e-3).all()


# Rooms in time


def _growth(S: Floats, parts: Floats, g: float, ticks: list[int], zeta: float, w: float) -> float:
    """Largest force of the last quarter of 1,500 ticks over that of the first, of hands held still.

    Args:
        S: Coupling of the hands, shape (n, n).
        parts: Of one mode, w of each hand times the root of K, shape (n,).
        g: Share of the swing that hands are shown.
        ticks: Delay of each loop.
        zeta: Damping of the mode.
        w: Its frequency [rad/s].
    """
    n, part = len(S), anticipated(S)
    step = step_of(np.array([w]), zeta, DT)[0]
    state, static = np.zeros(2), 0.0
    carried, swung = [np.zeros(n)], [0.0]
    sizes: list[float] = []
    for tick in range(1500):
        then = np.array([carried[max(0, tick - t)] for t in ticks])
        shown = np.array([swung[max(0, tick - t)] for t in ticks])
        d = np.ones(n) if tick < 5 else np.zeros(n)
        f = d - np.einsum("ij,ij->i", S, then) - g * parts * shown
        f = part.solve @ (f + np.einsum("ij,ij->i", part.X, then))
        state[0] -= float(parts @ f) - static
        static = float(parts @ f)
        state = step @ state
        carried.append(f)
        swung.append(float(state[0]))
        sizes.append(float(np.abs(f).max()))
        if sizes[-1] > 1e6:
            return float("inf")
    return max(sizes[-400:]) / max(sizes[5:405])


def test_rooms_come_to_rest_with_it_and_swing_up_with_all_of_a_large_swing() -> None:
    """Hands held still, at unequal delays; hands that move are in the bound above."""
    rng = np.random.default_rng(5)
    grown, least = 0, 1.0
    for _ in range(12):
        n = int(rng.integers(1, 5))
        S = 0.5 * coupling(rng, n)
        parts = rng.uniform(-0.7, 0.7, n)
        w, zeta = float(rng.uniform(6.0, 40.0)), float(rng.uniform(0.03, 0.1))
        gains = anticipated(S).gains
        held = Gains(0.0, gains.apart, gains.kappa)  # without the hands' own motion
        g = felt_fraction(held, 1e-9, np.inf, 0.0, float(parts @ parts), swing(w, zeta))
        ticks = rng.integers(1, 25, n).tolist()
        assert _growth(S, parts, g, ticks, zeta, w) < 0.5
        grown += _growth(S, parts, 1.0, ticks, zeta, w) > 1.0
        least = min(least, g)
    assert grown >= 4
    assert least < 0.5
