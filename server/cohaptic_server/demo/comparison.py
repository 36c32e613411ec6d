"""Compares the measured force on each hand with the reference, for a press or a drag."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from cohaptic_server.bodies.body import Body
from cohaptic_server.demo.analysis import Timeline, mean_over, measured
from cohaptic_server.demo.drag import RIGHT, reference_drag
from cohaptic_server.demo.lateness import LEAST, felt_delay
from cohaptic_server.demo.replay import felt_at_once
from cohaptic_server.demo.scene import Scene, reference
from cohaptic_server.numeric import Floats

_REPLAYED = 4  # windows from which delays are measured; each takes seconds of computation


@dataclass(frozen=True, slots=True)
class Compared:
    """Measured and reference forces of one user; NaN where a value is not known.

    Args:
        felt: Measured force due to the other users [N].
        reference: The same in the equilibrium of body and hands [N].
        error: Difference of the two over the reference, or over `LEAST` if that is larger.
        force: Measured force on the hand [N].
        reference_force: The same in equilibrium [N].
        delay: Delay of the force [s].
        friction_needed: Coefficient of friction below which the finger slips.
    """

    felt: float
    reference: float
    error: float
    force: float
    reference_force: float
    delay: float
    friction_needed: float = math.nan


def compare(
    scene: Scene,
    body: Body,
    timeline: Timeline,
    pressed: Sequence[slice],
    off: Sequence[slice],
    windows: Sequence[slice],
) -> list[Compared]:
    """Compare every user's forces with the reference, and measure the delays.

    Args:
        scene: The scene.
        body: The touched body.
        timeline: Recordings of the scene.
        pressed: Stretches in which the first hand stays pressed, or stays dragged.
        off: Stretches in which it stays off, or has not dragged yet.
        windows: Windows around the presses, or drags.
    """
    windows = windows[-_REPLAYED:]
    if scene.drags:
        return _drags(scene, body, timeline, pressed, off, windows)
    return _presses(scene, body, timeline, pressed, windows)


def _presses(
    scene: Scene,
    body: Body,
    timeline: Timeline,
    pressed: Sequence[slice],
    windows: Sequence[slice],
) -> list[Compared]:
    expected = reference(scene, body, pressed=True)
    ends = [measured(stretch) for stretch in pressed]
    felt, force = mean_over(timeline.felt, ends), mean_over(timeline.force, ends)
    share = np.abs(felt - expected.felt_from_others)
    share /= np.maximum(np.abs(expected.felt_from_others), LEAST)

    def delays(window: slice) -> list[float]:
        t, at_once = felt_at_once(timeline, body, window)
        times = timeline.t[window]
        # The first hand makes the change and has no delay.
        return [math.nan] + [
            felt_delay(times, timeline.felt[i, window], t, at_once[i])
            for i in range(1, scene.users)
        ]

    late = _median(delays, windows, scene.users)
    return [
        Compared(*map(float, row))
        for row in zip(
            felt, expected.felt_from_others, share, force, expected.force, late, strict=True
        )
    ]


def _drags(
    scene: Scene,
    body: Body,
    timeline: Timeline,
    dragged: Sequence[slice],
    rest: Sequence[slice],
    windows: Sequence[slice],
) -> list[Compared]:
    expected = reference_drag(scene, body)
    after = mean_over(timeline.forces, [measured(stretch) for stretch in dragged])
    before = mean_over(timeline.forces, [measured(stretch) for stretch in rest])
    change = expected.along(after - before)
    sizes = np.linalg.norm(expected.change, axis=1)
    error = np.linalg.norm(change - expected.change, axis=1) / np.maximum(sizes, LEAST)

    def delays(window: slice) -> list[float]:
        late = [math.nan] * scene.users
        late[RIGHT] = expected.delay(timeline, window)
        return late

    late = _median(delays, windows, scene.users)
    needed = expected.friction_needed
    # If one finger slips, the other is dragged less, and the reference holds for neither.
    whole = np.where((needed <= scene.friction).all(), 1.0, math.nan)
    return [
        Compared(*map(float, row))
        for row in zip(
            expected.felt(change),
            whole * sizes,
            whole * error,
            np.linalg.norm(after, axis=1),
            whole * np.linalg.norm(expected.dragged.force, axis=1),
            late,
            needed,
            strict=True,
        )
    ]


def _median(delays: Callable[[slice], list[float]], windows: Sequence[slice], users: int) -> Floats:
    """Median over the windows in which a force changed; NaN without any, shape (users,)."""
    values = np.array([delays(window) for window in windows]).reshape(-1, users)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # no force changed in any window
        return np.asarray(np.nanmedian(values, axis=0)) if len(values) else np.full(users, math.nan)
