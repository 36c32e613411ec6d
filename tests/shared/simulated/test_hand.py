from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic.errors import SettingError
from cohaptic.simulated.hand import Hand, HandScript, HandState, Rhythm, move
from cohaptic.vec import dot, norm, sub

hands = st.builds(
    Hand,
    mass=st.floats(0.05, 0.5),
    damping=st.floats(1.0, 10.0),
    stiffness=st.floats(100.0, 1000.0),
)


@given(hands, st.floats(-3.0, 3.0))
def test_a_held_hand_comes_to_rest_where_spring_and_force_balance(hand: Hand, force: float) -> None:
    state = HandState((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    for _ in range(20_000):
        state = move(state, hand, (0.01, 0.0, 0.0), (force, 0.0, 0.0), 0.001)
    assert state.position[0] == pytest.approx(0.01 + force / hand.stiffness, abs=1e-6)


@given(hands, st.floats(0.0001, 0.001))
def test_a_free_hand_never_gains_energy_for_good(hand: Hand, dt: float) -> None:
    state = HandState((0.02, 0.0, 0.0), (0.0, 0.0, 0.0))

    def energy(s: HandState) -> float:
        return (
            0.5 * hand.mass * norm(s.velocity) ** 2 + 0.5 * hand.stiffness * norm(s.position) ** 2
        )

    start = energy(state)
    for _ in range(2000):
        state = move(state, hand, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), dt)
        # Semi-implicit Euler swings about the true energy by omega dt.
        assert energy(state) < 1.2 * start


@given(st.floats(0.01, 5.0), st.floats(0.0, 1000.0))
def test_the_stiffest_hand_that_is_allowed_is_stable(mass: float, damping: float) -> None:
    hand = Hand(mass, damping, min(1e5, 1e6 * mass))
    state = HandState((0.02, 0.0, 0.0), (0.0, 0.0, 0.0))
    for _ in range(2000):
        state = move(state, hand, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0.001)
        assert abs(state.position[0]) < 0.03


@given(st.floats(0.2, 20.0), st.floats(0.0, 100.0))
def test_a_rhythm_is_continuous_and_repeats(period: float, t: float) -> None:
    rhythm = Rhythm(period)
    assert 0.0 <= rhythm.level(t) <= 1.0
    assert abs(rhythm.level(t + 1e-6) - rhythm.level(t)) < 1e-6 * 2.0 / rhythm.ramp
    assert rhythm.level(t + period) == pytest.approx(rhythm.level(t), abs=1e-6)


@given(st.floats(-6.28, 6.28), st.floats(0.0, 0.05), st.floats(0.0, 20.0))
def test_a_script_presses_straight_towards_the_middle(angle: float, depth: float, t: float) -> None:
    center = (0.3, -0.1, 0.2)
    intention = HandScript(angle=angle, depth=depth).intention(center, 0.1)
    distance = norm(sub(intention.position(t), center))
    assert 0.1 - depth - 1e-9 <= distance <= 0.1 + intention.clearance + 1e-9
    assert norm(sub(intention.tip(1.0), center)) == pytest.approx(0.1 - depth)


@pytest.mark.parametrize(
    "make",
    [
        lambda: Hand(mass=0.0),
        lambda: Hand(stiffness=float("nan")),
        lambda: Hand(mass=0.02, stiffness=5e4),
        lambda: Rhythm(0.0),
        lambda: HandScript(depth=-1.0),
        lambda: HandScript(angle=float("inf")),
        lambda: HandScript(angle=180.0),
    ],
)
def test_absurd_hands_are_refused(make: object) -> None:
    assert callable(make)
    with pytest.raises(SettingError):
        make()


# Hands that drag


@given(st.floats(-6.28, 6.28), st.floats(-0.02, 0.02))
def test_a_drag_goes_level_along_the_surface_to_the_hands_right(angle: float, drag: float) -> None:
    script = HandScript(angle=angle, rhythm=Rhythm(4.0), drag=drag)
    way = script.intention((0.0, 0.0, 0.0), 0.1).drag
    assert norm(way) == pytest.approx(abs(drag))
    assert dot(way, (math.cos(angle), math.sin(angle), 0.0)) == pytest.approx(0.0, abs=1e-12)
    # Counter-clockwise seen from above.
    assert dot(way, (-math.sin(angle), math.cos(angle), 0.0)) == pytest.approx(drag, abs=1e-12)
