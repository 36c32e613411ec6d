from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from cohaptic_server.bodies.balloon.balloon import Balloon
from cohaptic_server.numeric import Floats
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


def test_left_is_held_back_and_right_is_taken_along(balloon: Balloon, true: Drag) -> None:
    """`right` stands on the right of `left`, who drags towards it: both along the equator."""
    way = np.array([0.0, -1.0, 0.0])  # from -x to the right of who looks inward
    assert true.change[LEFT] @ way < -0.5
    assert true.change[RIGHT] @ way > 0.5


def test_compliances_say_what_a_force_does_elsewhere(true: Drag) -> None:
    """The whole of C is symmetric, and each contact gives way to its own force."""
    C = true.compliance.reshape(6, 6)
    assert pytest.approx(C.T, abs=1e-12) == C
    assert np.linalg.eigvalsh(C).min() > 0.0
    # The change of both forces is that of tips which the hands move: it solves the same system.
    moved = -np.einsum("uivj,vj->ui", true.compliance, true.dragged.force - true.rest.force)
    assert moved[LEFT] @ true.change[LEFT] < 0.0


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


def test_an_arm_that_follows_late_does_not_count(balloon: Balloon, true: Drag) -> None:
    """`right` gives way or not: its material is where it is."""
    timeline = Timeline.of(dragged(SCENE, balloon, seconds=9.0, delay=0.1))
    (window,) = press_windows(timeline, injected=0.2)
    # The same material with an arm that is held: the force is then larger, the tip at rest.
    C = true.compliance[RIGHT, :, RIGHT, :]
    tips, forces = timeline.tips[RIGHT], timeline.forces[RIGHT]
    material = tips + C @ forces
    held: Floats = np.asarray(np.linalg.solve(C, material - tips[:, :1]), dtype=np.float64)
    columns = {name: values.copy() for name, values in timeline.columns.items()}
    for i, (tip, force) in enumerate((("x", "fx"), ("y", "fy"), ("z", "fz"))):
        columns[tip][RIGHT], columns[force][RIGHT] = tips[i, 0], held[i]
    stiff = replace(timeline, columns=columns)
    assert true.delay(stiff, window).half == pytest.approx(
        true.delay(timeline, window).half, abs=1e-6
    )


def test_a_drag_that_is_not_felt_has_no_delay(balloon: Balloon, true: Drag) -> None:
    timeline = Timeline.of(dragged(SCENE, balloon, seconds=9.0, delay=0.1))
    (window,) = press_windows(timeline, injected=0.2)
    columns = {name: values.copy() for name, values in timeline.columns.items()}
    for name in ("x", "y", "z", "fx", "fy", "fz"):
        columns[name][RIGHT] = columns[name][RIGHT, 0]
    assert all(map(math.isnan, true.delay(replace(timeline, columns=columns), window)))
