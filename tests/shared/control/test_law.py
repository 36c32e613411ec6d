from __future__ import annotations

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from cohaptic.control.geometry import Sight
from cohaptic.control.law import Law, pressed_depth
from cohaptic.control.laws.model import Gains, LawSettings, Thresholds
from cohaptic.control.laws.pi import IntegralState

T = 0.001  # s
stiffness = st.floats(20.0, 2000.0)
laws = st.sampled_from(Law)
UP = (0.0, 0.0, 1.0)


def sight(depth: float, c_ii: float, own_force: float = 0.0, u_others: float = 0.0) -> Sight:
    """What counts of both vectors is along the normal: along the surface they are anything."""
    return Sight(depth, UP, c_ii, (0.7, -0.3, own_force), (0.002, 0.005, u_others))


@pytest.mark.parametrize(
    ("law", "felt"), [("predictive", 49.0), ("pi", 49.0), ("proportional", 39.36)]
)
def test_a_hand_alone_feels_no_more_than_the_object(law: str, felt: float) -> None:
    """To the last digit where it is the object's own; eq. (11) for the proportional law."""
    assert Law(law).model.felt_stiffness(200.0, 49.0) == pytest.approx(felt, rel=1e-4)
    assert (Law(law).model.felt_stiffness(200.0, 49.0) == 49.0) == (law != "proportional")


@given(laws, stiffness, st.floats(-0.02, 0.02), st.floats(0.01, 1.0), st.floats(0.0, 1e4))
def test_a_surface_only_pushes(
    law: Law, k_o: float, depth: float, fraction: float, integral_gain: float
) -> None:
    gains = Gains(fraction * k_o, integral_gain)
    _, f = law.model.force(None, sight(depth, 1.0 / k_o), gains, T)
    assert f.normal_force >= 0.0
    assert (f.normal_force > 0.0) == (fraction * k_o * depth > 0.0)


@given(stiffness, st.floats(0.001, 0.02))
def test_predictive_alone_feels_exactly_k_o_whatever_is_on_its_way(
    k_o: float, indentation: float
) -> None:
    """Science 3.3: no delay enters, because its own force is not in the surface."""
    for own_force in (0.0, 3.0):
        seen = sight(indentation, 1.0 / k_o, own_force)
        _, f = Law.PREDICTIVE.model.force(None, seen, Gains(k_o), T)
        assert f.normal_force == pytest.approx(k_o * indentation)
        assert f.indentation == pytest.approx(indentation)
        assert f.felt_from_others == 0.0


@given(stiffness, st.floats(0.01, 1.0), st.floats(0.0, 1e4), st.floats(0.001, 0.02))
def test_predictive_has_no_memory_and_no_integral(
    k_o: float, fraction: float, integral_gain: float, depth: float
) -> None:
    """Science 3.8: f = K d at once and for good, whatever integral a server names."""
    gains = Gains(fraction * k_o, integral_gain)
    memory: object = None
    for _ in range(50):
        memory, f = Law.PREDICTIVE.model.force(memory, sight(depth, 1.0 / k_o), gains, T)
        assert f.normal_force == fraction * k_o * depth
    assert memory is None


@given(laws, stiffness, st.floats(-0.005, 0.02), st.floats(0.0, 3.0), st.floats(0.05, 1.0))
def test_the_stored_energy_is_the_work_of_pressing_in(
    law: Law, k_o: float, depth: float, own: float, fraction: float
) -> None:
    """Of the law's spring; an integral is no spring, and stores nothing that could be got back."""
    seen = sight(depth, 1.0 / k_o, own)
    _, f = law.model.force(None, seen, Gains(fraction * k_o), T)
    pressed = max(0.0, pressed_depth(law, seen))
    assert f.stored == pytest.approx(0.5 * fraction * k_o * pressed * pressed, abs=1e-15)
    _, charged = Law.PI.model.force(IntegralState(2.0, 0.0, depth), seen, Gains(fraction * k_o), T)
    _, empty = Law.PI.model.force(None, seen, Gains(fraction * k_o), T)
    assert charged.stored == empty.stored


@given(stiffness, st.floats(0.05, 0.95), st.floats(0.001, 0.02), st.integers(0, 20))
def test_proportional_settles_where_eq_11_says_at_any_delay(
    k_o: float, fraction: float, x_h: float, delay: int
) -> None:
    """x_o = K_h x_h / (K_h + K_o), reached for K_h < K_o whatever the delay in ticks (3.1)."""
    k_h = fraction * k_o
    on_the_way = [0.0] * (delay + 1)
    f = 0.0
    for _ in range(8000):
        seen = sight(x_h, 1.0 / k_o, on_the_way.pop(0))
        f = Law.PROPORTIONAL.model.force(None, seen, Gains(k_h), T)[1].normal_force
        on_the_way.append(f)
    assert f / k_o == pytest.approx(k_h / (k_h + k_o) * x_h, rel=1e-3)


@given(stiffness, st.floats(0.05, 0.6), st.floats(0.005, 0.02), st.floats(0.0, 0.004))
@example(k_o=321.0, fraction=0.25, x_h=0.01953125, theta=0.0)
def test_pi_settles_where_its_threshold_says(
    k_o: float, fraction: float, x_h: float, theta: float
) -> None:
    """Steady state of eq. (17): x_h - x_o = theta; less where K_h alone comes nearer (11).

    Without a threshold the probe comes to rest on the surface itself, where one rounding is a
    contact that opens: the integral then gives back one period's part of its release, and no more.
    """
    settings = LawSettings(Thresholds(theta, theta, 0.0), 0.1, 1e6)
    gains = Gains(fraction * k_o, 0.2 * k_o / T)
    memory: object = None
    f = 0.0
    for _ in range(8000):
        seen = sight(x_h, 1.0 / k_o, f)
        memory, force = Law.PI.model.force(memory, seen, gains, T, settings)
        f = force.normal_force
    expected = min(theta, x_h / (1.0 + fraction))
    opened = x_h * T / settings.release_time if theta < 1e-9 else 0.0
    assert x_h - f / k_o == pytest.approx(expected, abs=5e-6 + opened)


@given(laws, stiffness, st.floats(-0.005, 0.02), st.floats(0.0, 0.01))
def test_the_part_felt_from_others_is_the_rest_of_the_force(
    law: Law, k_o: float, alone: float, lift: float
) -> None:
    """Force with others = force at the same place without them + felt of others."""
    c, k_h = 1.0 / k_o, 0.9 * k_o
    seen = sight(alone + lift, c, 0.0, lift)  # the others have lifted the surface by `lift`
    _, f = law.model.force(None, seen, Gains(k_h), T)
    fraction = {Law.PREDICTIVE: k_h, Law.PROPORTIONAL: 1.0 / (c + 1.0 / k_h)}.get(law, k_h)
    if alone + lift > 0.0:
        without = fraction * max(0.0, alone)
        assert f.normal_force - f.felt_from_others == pytest.approx(without, abs=1e-9)
    if law is Law.PREDICTIVE:
        assert f.felt_from_others >= -1e-12


@given(laws, stiffness, st.floats(0.001, 0.02), st.floats(0.0, 8.0), st.floats(0.05, 0.9))
def test_a_law_that_begins_with_a_force_goes_on_with_it(
    law: Law, k_o: float, depth: float, force: float, fraction: float
) -> None:
    """Where it can: an integral gives what the spring lacks, and no law takes what a spring has."""
    seen, gains = sight(depth, 1.0 / k_o), Gains(fraction * k_o, 500.0)
    memory = law.model.begin(force, gains, pressed_depth(law, seen))
    held = LawSettings(Thresholds(1.0, 1.0, 0.0))  # the integral neither grows nor falls by itself
    _, f = law.model.force(memory, seen, gains, 0.0, held, 0.0, 0.0)
    spring = fraction * k_o * depth
    expected = max(force, spring) if law.model.integrates else spring
    assert f.normal_force == pytest.approx(expected)


@given(laws, stiffness, st.floats(0.001, 0.02), st.floats(0.0, 8.0), st.floats(0.0, 8.0))
def test_a_memory_that_is_held_to_a_force_gives_no_more_than_it_or_the_spring(
    law: Law, k_o: float, depth: float, force: float, limit: float
) -> None:
    """What is below that stays as it is, and a law without a memory has nothing to be held."""
    seen, gains = sight(depth, 1.0 / k_o), Gains(0.3 * k_o, 500.0)
    before = law.model.begin(force, gains, pressed_depth(law, seen))
    memory = law.model.held_to(before, limit, gains)
    still = LawSettings(Thresholds(1.0, 1.0, 0.0))
    spring = 0.3 * k_o * depth
    given = law.model.force(memory, seen, gains, 0.0, still, 0.0, 0.0)[1].normal_force
    wanted = law.model.force(before, seen, gains, 0.0, still, 0.0, 0.0)[1].normal_force
    assert given == pytest.approx(min(wanted, max(limit, spring)))
    if wanted < limit:
        assert memory is before
