from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic.errors import SettingError
from cohaptic.simulated.delay_line import LinkSettings
from cohaptic_server.bodies.balloon.balloon import Balloon
from cohaptic_tools.demo.scene import BESIDE, DRAG, PRESS_DEPTH, Scene, reference

users = st.integers(2, 16)


@given(users)
def test_everybody_has_a_name_and_a_place(n: int) -> None:
    scene = Scene(n)
    assert len(set(scene.names)) == len(scene.names) == len(scene.angles) == n
    places = sorted(angle % (2.0 * math.pi) for angle in scene.angles)
    gaps = [b - a for a, b in zip(places, [*places[1:], places[0] + 2 * math.pi], strict=True)]
    assert gaps == pytest.approx([2.0 * math.pi / n] * n)


@given(st.floats(5.0, 60.0), st.floats(0.0, 1.0))
def test_a_press_and_a_release_fit_into_the_duration(duration: float, delay: float) -> None:
    assert Scene(link=LinkSettings(delay), duration=duration).rhythm.period <= duration - 3.0


@pytest.mark.parametrize("n", [-1, 0, 1, 17])
def test_a_crowd_that_cannot_be_shown_is_refused_with_the_limits(n: int) -> None:
    with pytest.raises(SettingError, match=f"number of users is {n}; it must be from 2 to 16"):
        Scene(n)


def test_the_truth_of_a_press_is_felt_by_everybody(balloon: Balloon) -> None:
    scene = Scene(2)
    pressed = reference(scene, balloon, pressed=True)
    released = reference(scene, balloon, pressed=False)
    assert released.force[0] == 0.0
    # `right` is alone with the body while `left` is off, and then is pushed.
    assert released.felt_from_others[1] == pytest.approx(0.0, abs=1e-4)
    assert (pressed.felt_from_others > 0.3).all()
    assert pressed.force[1] > released.force[1] + 0.3


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
