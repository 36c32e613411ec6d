"""What each hand felt, beside what it should have felt: of a press, or of a drag."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from cohaptic_server.bodies.body import Body
from cohaptic_server.demo.analysis import Timeline, mean_over, measured
from cohaptic_server.demo.drag import RIGHT, true_drag
from cohaptic_server.demo.lateness import LEAST, felt_delay
from cohaptic_server.demo.replay import felt_at_once
from cohaptic_server.demo.scene import Scene, truth
from cohaptic_server.numeric import Floats

_REPLAYED = 4  # presses from which delays are found; each is seconds of a body's work


@dataclass(frozen=True, slots=True)
class Compared:
    """One user; NaN where it is not known.

    Args:
        felt: Force that is there because of the others [N].
        truth: The same in equilibrium [N].
        error: Their difference over the truth, or over `LEAST` where that is more.
        force: Whole force on the hand [N].
        true_force: The same in equilibrium [N].
        delay: How late the force was felt [s].
        friction_needed: Coefficient below which the finger slips.
    """

    felt: float
    truth: float
    error: float
    force: float
    true_force: float
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
    """Every user's forces and delay beside the truth.

    Args:
        scene: That was shown.
        body: That was touched.
        timeline: Of the recordings.
        pressed: Stretches in which the first hand stayed pressed, or dragged.
        off: Those in which it stayed off, or had not dragged.
        windows: Round each press, or drag.
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
    true = truth(scene, body, pressed=True)
    ends = [measured(stretch) for stretch in pressed]
    felt, force = mean_over(timeline.felt, ends), mean_over(timeline.force, ends)
    share = np.abs(felt - true.felt_from_others) / np.maximum(np.abs(true.felt_from_others), LEAST)

    def delays(window: slice) -> list[float]:
        t, at_once = felt_at_once(timeline, body, window)
        here = timeline.t[window]
        # The first hand makes the change itself.
        return [math.nan] + [
            felt_delay(here, timeline.felt[i, window], t, at_once[i]) for i in range(1, scene.users)
        ]

    late = _median(delays, windows, scene.users)
    return [
        Compared(*map(float, row))
        for row in zip(felt, true.felt_from_others, share, force, true.force, late, strict=True)
    ]


def _drags(
    scene: Scene,
    body: Body,
    timeline: Timeline,
    dragged: Sequence[slice],
    rest: Sequence[slice],
    windows: Sequence[slice],
) -> list[Compared]:
    true = true_drag(scene, body)
    after = mean_over(timeline.forces, [measured(stretch) for stretch in dragged])
    before = mean_over(timeline.forces, [measured(stretch) for stretch in rest])
    change = true.along(after - before)
    sizes = np.linalg.norm(true.change, axis=1)
    error = np.linalg.norm(change - true.change, axis=1) / np.maximum(sizes, LEAST)

    def delays(window: slice) -> list[float]:
        late = [math.nan] * scene.users
        late[RIGHT] = true.delay(timeline, window)
        return late

    late = _median(delays, windows, scene.users)
    needed = true.friction_needed
    # Where one slips the other is dragged less: there is nothing to compare either with.
    whole = np.where((needed <= scene.friction).all(), 1.0, math.nan)
    return [
        Compared(*map(float, row))
        for row in zip(
            true.felt(change),
            whole * sizes,
            whole * error,
            np.linalg.norm(after, axis=1),
            whole * np.linalg.norm(true.dragged.force, axis=1),
            late,
            needed,
            strict=True,
        )
    ]


def _median(delays: Callable[[slice], list[float]], windows: Sequence[slice], users: int) -> Floats:
    """Over the windows in which something was felt; NaN without any, shape (users,)."""
    found = np.array([delays(window) for window in windows]).reshape(-1, users)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # nothing was felt in any of them
        return np.asarray(np.nanmedian(found, axis=0)) if len(found) else np.full(users, math.nan)
