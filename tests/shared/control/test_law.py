from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic.control.geometry import LocalSurface
from cohaptic.control.law import Law, local_force

stiffness = st.floats(20.0, 2000.0)
laws = st.sampled_from(Law)


def surface(c_ii: float, own_force: float = 0.0, u_others: float = 0.0) -> LocalSurface:
    return LocalSurface((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), 0.0, c_ii, own_force, u_others)


@given(laws, stiffness, st.floats(-0.02, 0.02), st.floats(0.0, 1.0))
def test_a_surface_only_pushes(law: Law, k_o: float, z: float, share: float) -> None:
    f = local_force(law, surface(1.0 / k_o), (0.0, 0.0, z), k_h=share * k_o)
    assert f.normal_force >= 0.0
    assert (f.normal_force > 0.0) == (z < 0.0 and share * k_o * -z > 0.0)


@given(stiffness, st.floats(0.001, 0.02))
def test_predictive_alone_feels_exactly_k_o_whatever_is_on_its_way(
    k_o: float, indentation: float
) -> None:
    """Science 3.3: no delay enters, because its own force is not in the surface."""
    for own_force in (0.0, 3.0):
        f = local_force(
            Law.PREDICTIVE, surface(1.0 / k_o, own_force), (0.0, 0.0, -indentation), k_h=k_o
        )
        assert f.normal_force == pytest.approx(k_o * indentation)
        assert f.indentation == pytest.approx(indentation)
        assert f.felt_from_others == 0.0


@given(stiffness, st.floats(0.05, 0.95), st.floats(0.001, 0.02), st.integers(0, 20))
def test_proportional_settles_where_eq_11_says_at_any_delay(
    k_o: float, share: float, x_h: float, delay: int
) -> None:
    """x_o = K_h x_h / (K_h + K_o), reached for K_h < K_o whatever the delay in ticks (3.1)."""
    k_h = share * k_o
    on_the_way = [0.0] * (delay + 1)
    f = 0.0
    for _ in range(4000):
        f = local_force(
            Law.PROPORTIONAL, surface(1.0 / k_o, on_the_way.pop(0)), (0.0, 0.0, -x_h), k_h=k_h
        ).normal_force
        on_the_way.append(f)
    assert f / k_o == pytest.approx(k_h / (k_h + k_o) * x_h, rel=1e-3)


@given(laws, stiffness, st.floats(-0.005, 0.02), st.floats(0.0, 0.01))
def test_what_is_felt_of_others_is_the_rest_of_the_force(
    law: Law, k_o: float, alone: float, lift: float
) -> None:
    """Force with others = force at the same place without them + felt of others."""
    c, k_h = 1.0 / k_o, 0.9 * k_o
    probe = (0.0, 0.0, -(alone + lift))  # the others have lifted the surface by `lift`
    f = local_force(law, surface(c, 0.0, lift), probe, k_h=k_h)
    if law is Law.PREDICTIVE:
        without = local_force(law, surface(c), (0.0, 0.0, -alone), k_h=k_h).normal_force
        assert f.normal_force - f.felt_from_others == pytest.approx(without, abs=1e-12)
        assert f.felt_from_others >= 0.0
    else:
        assert f.normal_force - f.felt_from_others == pytest.approx(
            max(0.0, alone) / (c + 1.0 / k_h), abs=1e-12
        )
