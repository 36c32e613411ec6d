from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from cohaptic_server.bodies.balloon.balloon import Balloon
from cohaptic_tools.demo.analysis import Timeline, press_windows
from cohaptic_tools.demo.comparison import LEFT, RIGHT, Drag, reference_drag
from cohaptic_tools.demo.scene import Scene
from tests.demo.recordings import dragged

SCENE = Scene(friction=0.8, duration=9.0)


@pytest.fixture(scope="module")
def true(balloon: Balloon) -> Drag:
    return reference_drag(SCENE, balloon)


def test_the_drag_of_one_is_felt_along_the_surface_by_the_other(true: Drag) -> None:
    """About 0.65 N, clearly felt; and a dry fingertip holds it."""
    sizes = np.linalg.norm(true.change, axis=1)
    assert sizes[RIGHT] > 0.5
    assert sizes[LEFT] > sizes[RIGHT]
    assert (true.friction_needed < SCENE.friction).all()
    assert np.einsum("ui,ui->u", true.change, true.rest.normal) == pytest.approx(0.0, abs=1e-12)


def test_a_measured_change_is_taken_along_the_surface_and_in_the_true_direction(
    true: Drag,
) -> None:
    normal = true.rest.normal
    measured = true.along(0.5 * true.change + 3.0 * normal)
    assert measured == pytest.approx(0.5 * true.change)
    assert true.felt(measured) == pytest.approx(0.5 * np.linalg.norm(true.change, axis=1))
    aside = np.cross(normal, true.change)
    assert true.felt(aside) == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("delay", [0.0, 0.19, 0.6])
def test_the_delay_of_a_drag_is_found(balloon: Balloon, true: Drag, delay: float) -> None:
    """From the material under the hand, so that what its own arm does is not counted."""
    timeline = Timeline.of(dragged(SCENE, balloon, seconds=9.0, delay=delay))
    (out,) = press_windows(timeline, injected=0.2)
    assert true.delay(timeline, out).half == pytest.approx(delay, abs=0.002)


def test_a_drag_that_is_not_felt_has_no_delay(balloon: Balloon, true: Drag) -> None:
    timeline = Timeline.of(dragged(SCENE, balloon, seconds=9.0, delay=0.1))
    (window,) = press_windows(timeline, injected=0.2)
    columns = {name: values.copy() for name, values in timeline.columns.items()}
    for name in ("x", "y", "z", "fx", "fy", "fz"):
        columns[name][RIGHT] = columns[name][RIGHT, 0]
    assert all(map(math.isnan, true.delay(replace(timeline, columns=columns), window)))
