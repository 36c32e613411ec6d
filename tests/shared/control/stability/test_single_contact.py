from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from cohaptic.control.stability.single_contact import (
    StateSpace,
    elastic_object,
    integral_is_stable,
    integral_model,
    lifted_radius,
    proportional_is_stable,
    proportional_model,
)
from tests.examples_of_laws import examples

T = 0.001  # s
stiffness = st.floats(50.0, 800.0)
fractions = st.floats(0.05, 2.0)
ratios = st.integers(2, 100)
EDGE = 1e-6  # of a spectral radius, within which rounding decides


def unlike(radius: float) -> None:
    assume(abs(radius - 1.0) > EDGE)


@given(stiffness, fractions, st.floats(0.0, 1.0), ratios)
@settings(max_examples=examples(1000), deadline=None)
def test_8_and_10_agree_with_the_lifted_system(
    k_o: float, fraction: float, damping: float, n: int
) -> None:
    k_h, b_o = fraction * k_o, damping * k_o
    radius = lifted_radius(proportional_model(k_h), elastic_object(k_o, b_o), n)
    unlike(radius)
    assert (radius < 1.0) == proportional_is_stable(k_h, k_o, b_o)


@given(stiffness, fractions, st.floats(0.01, 3.0), st.floats(0.0, 1.0), ratios)
@settings(max_examples=examples(1000), deadline=None)
def test_15_and_16_agree_with_the_lifted_system(
    k_o: float, fraction: float, integral: float, damping: float, n: int
) -> None:
    k_h, b_o, gain = fraction * k_o, damping * k_o, integral * k_o / (n * T)
    radius = lifted_radius(integral_model(k_h, gain, T), elastic_object(k_o, b_o), n)
    unlike(radius)
    assert (radius < 1.0) == integral_is_stable(k_h, gain, k_o, n * T, b_o)


@given(stiffness, fractions, st.integers(0, 8), ratios)
@settings(max_examples=examples(500), deadline=None)
def test_8_holds_for_every_delay(k_o: float, fraction: float, d: int, n: int) -> None:
    """z^(d+1) + K_h / K_o = 0, science 3.1."""
    radius = lifted_radius(proportional_model(fraction * k_o), elastic_object(k_o), n, d * n)
    assert radius == pytest.approx(fraction ** (1.0 / (d + 1)), abs=1e-6)


@given(stiffness, fractions, st.floats(0.01, 3.0), st.integers(0, 6), ratios)
@settings(max_examples=examples(500), deadline=None)
def test_the_delayed_integral_loop_has_its_characteristic_polynomial(
    k_o: float, fraction: float, integral: float, d: int, n: int
) -> None:
    """z^(d+1) (z - 1) K_o + K_h (z - 1) + I N T = 0, science 3.1."""
    k_h, int_ = fraction * k_o, integral * k_o
    radius = lifted_radius(integral_model(k_h, int_ / (n * T), T), elastic_object(k_o), n, d * n)
    polynomial = np.zeros(d + 3)
    polynomial[[0, 1]] = k_o, -k_o
    polynomial[[-2, -1]] += k_h, int_ - k_h
    # Multiple roots move by the root of the rounding.
    assert radius == pytest.approx(np.abs(np.roots(polynomial)).max(), abs=1e-4)


def simulate(local: StateSpace, body: StateSpace, n: int, delay: int, periods: int) -> list[float]:
    """Size of force and position over the periods, sample by sample, from a disturbed start."""
    state, x = np.ones((len(local.A), 1)), np.ones((len(body.A), 1))
    seen, on_the_way, sizes = 1.0, dict[int, float](), list[float]()
    for k in range(periods):
        for i in range(n):
            seen = on_the_way.pop(k * n + i, seen)
            u = np.array([[-seen]])
            f = local.C @ state + local.D @ u
            if i == 0:
                x = body.A @ x + body.B @ f
                on_the_way[(k + 1) * n + delay] = (body.C @ x).item()
                sizes.append(abs(f.item()) + abs(seen))
            state = local.A @ state + local.B @ u
    return sizes


@given(
    stiffness, st.floats(0.1, 1.3), st.floats(0.02, 1.2), st.floats(0.0, 0.5),
    st.integers(2, 12), st.integers(0, 30),
)  # fmt: skip
@settings(max_examples=examples(300), deadline=None)
def test_the_lifted_system_agrees_with_a_simulation_at_fractions_of_a_tick(
    k_o: float, fraction: float, integral: float, damping: float, n: int, delay: int
) -> None:
    local = integral_model(fraction * k_o, integral * k_o / (n * T), T)
    body = elastic_object(k_o, damping * k_o)
    radius = lifted_radius(local, body, n, delay)
    assume(abs(radius - 1.0) > 0.02)
    sizes = simulate(local, body, n, delay, 400)
    early, late = max(sizes[20:60]), max(sizes[360:])
    # 340 periods at 2 % from the edge change a size by a factor of 800 at least.
    assert (late < early) == (radius < 1.0)
