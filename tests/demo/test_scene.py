from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic.errors import SettingError
from cohaptic.simulated.delay_line import LinkSettings
from cohaptic.simulated.hand import Place
from cohaptic_server.bodies.balloon.balloon import Balloon
from cohaptic_tools.demo.scene import BESIDE, DRAG, MEASURE, PRESS_DEPTH, Scene, reference

users = st.integers(2, 16)


@given(users)
def test_everybody_has_a_name_and_a_place(n: int) -> None:
    scene = Scene(n)
    assert len(set(scene.names)) == len(scene.names) == len(scene.angles) == n
    places = sorted(angle % (2.0 * math.pi) for angle in scene.angles)
    gaps = [b - a for a, b in zip(places, [*places[1:], places[0] + 2 * math.pi], strict=True)]
    assert gaps == pytest.approx([2.0 * math.pi / n] * n)


def test_names_are_left_right_and_numbers() -> None:
    assert Scene(4).names == ("left", "right", "user3", "user4")


@given(users)
def test_right_is_opposite_left_or_as_near_to_it_as_an_odd_crowd_lets_it(n: int) -> None:
    left, right, *_ = Scene(n).angles
    assert math.cos(left) == pytest.approx(-1.0)
    off = abs(right - left - math.pi)
    assert off == pytest.approx(0.0 if n % 2 == 0 else math.pi / n)


def test_the_first_hand_presses_and_the_others_rest() -> None:
    scene = Scene(3)
    scripts = [scene.script(user) for user in range(3)]
    assert [s.depth for s in scripts] == [PRESS_DEPTH, 0.5 * PRESS_DEPTH, 0.5 * PRESS_DEPTH]
    assert [s.rhythm for s in scripts] == [scene.rhythm, None, None]
    assert tuple(s.angle for s in scripts) == scene.angles


@given(st.floats(0.0, 2.0), st.floats(0.0, 1.0))
def test_a_longer_way_gets_a_slower_rhythm(delay: float, jitter: float) -> None:
    """Five round trips and the time to measure fit into every press."""
    half = 0.5 * Scene(link=LinkSettings(delay, jitter)).rhythm.period
    assert half >= 5.0 * 2.0 * (delay + jitter) + MEASURE


@given(st.floats(5.0, 60.0), st.floats(0.0, 1.0))
def test_a_press_and_a_release_fit_into_the_duration(duration: float, delay: float) -> None:
    assert Scene(link=LinkSettings(delay), duration=duration).rhythm.period <= duration - 3.0


@pytest.mark.parametrize("n", [-1, 0, 1, 17])
def test_a_crowd_that_cannot_be_shown_is_refused_with_the_limits(n: int) -> None:
    with pytest.raises(SettingError, match=f"number of users is {n}; it must be from 2 to 16"):
        Scene(n)


@pytest.mark.parametrize("duration", [-1.0, 0.0, 1.9, 1e5, math.inf, math.nan])
def test_an_absurd_duration_is_refused_with_the_limits(duration: float) -> None:
    with pytest.raises(SettingError, match=f"duration is {duration:g} s; it must be from 2 s"):
        Scene(duration=duration)


def test_the_truth_of_a_press_is_felt_by_everybody(balloon: Balloon) -> None:
    scene = Scene(2)
    pressed = reference(scene, balloon, pressed=True)
    released = reference(scene, balloon, pressed=False)
    assert released.force[0] == 0.0
    # `right` is alone with the body while `left` is off, and then is pushed.
    assert released.felt_from_others[1] == pytest.approx(0.0, abs=1e-4)
    assert (pressed.felt_from_others > 0.3).all()
    assert pressed.force[1] > released.force[1] + 0.3


def test_hands_with_places_stand_there(balloon: Balloon) -> None:
    places = (
        Place((0.0, 0.1, 0.0), (0.0, -1.0, 0.0)),
        Place((0.0, -0.1, 0.0), (0.0, 1.0, 0.0)),
    )
    scene = Scene(2, places=places, depth=0.016)
    scripts = [scene.script(user) for user in range(2)]
    assert [s.place for s in scripts] == list(places)
    assert [s.depth for s in scripts] == [0.016, 0.008]
    pressed = reference(scene, balloon, pressed=True)
    assert pressed.tip[0, 1] > 0.05 > -0.05 > pressed.tip[1, 1]


def test_with_friction_two_stand_side_by_side_and_the_first_drags() -> None:
    scene = Scene(friction=0.8)
    left, right = (scene.script(user) for user in range(2))
    assert (left.drag, right.drag) == (DRAG, 0.0)
    assert (left.rhythm, right.rhythm) == (scene.rhythm, None)
    assert left.depth == right.depth == PRESS_DEPTH
    # On the side to which it drags.
    assert right.angle - left.angle == pytest.approx(BESIDE)
    assert not Scene().drags
    assert Scene().script(0).drag == 0.0


@given(st.floats(6.0, 60.0), st.floats(0.0, 1.0))
def test_a_press_and_a_drag_fit_into_the_duration(duration: float, delay: float) -> None:
    scene = Scene(link=LinkSettings(delay), duration=duration, friction=0.8)
    assert 1.5 * scene.rhythm.period <= duration - 3.0 + 1e-9


@pytest.mark.parametrize("mu", [-0.1, 2.1, math.nan])
def test_an_absurd_friction_is_refused_with_the_limits(mu: float) -> None:
    with pytest.raises(SettingError, match=r"friction is .*; it must be from 0 to 2"):
        Scene(friction=mu)


def test_nobody_is_dragged_by_a_crowd() -> None:
    with pytest.raises(SettingError, match="number of users with friction is 3; it must be 2"):
        Scene(3, friction=0.5)
