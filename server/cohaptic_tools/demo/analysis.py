"""Puts recordings on one time grid, and finds the windows to measure. Functions of arrays."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from cohaptic.recording.archive import read_recording
from cohaptic_server.numeric import Floats
from cohaptic_tools.demo.scene import MEASURE

STEP = 0.001  # s; step of the time grid
AROUND = 0.5  # s; part of a window before a press, at rest
# Least part of a window after the start of the press, in addition to the injected delay [s]; a
# change of force is complete by then.
_AFTER = 1.0


@dataclass(frozen=True, eq=False)
class Recording:
    """Recording of one user.

    Args:
        name: Name of the user.
        columns: Each column of `cohaptic.status.row.Row`, shape (n,) for n haptic periods; `t` is
            Unix time [s].
    """

    name: str
    columns: dict[str, Floats]

    @classmethod
    def load(cls, path: Path) -> Recording:
        """Load a file that `cohaptic touch --record` has written."""
        found = read_recording(path)
        columns = dict(zip(found.outline.header.columns, found.rows.T, strict=True))
        columns["t"] = columns["t"] + found.to_wall
        return cls(found.outline.header.name, columns)


@dataclass(frozen=True, eq=False)
class Timeline:
    """Recordings of all users on one time grid with n instants.

    Args:
        t: Grid [s], shape (n,).
        columns: Each column of the recordings, shape (users, n).
    """

    t: Floats
    columns: dict[str, Floats]

    @classmethod
    def of(cls, recordings: Sequence[Recording]) -> Timeline:
        """Interpolate recordings on one grid, over the time that all of them cover."""
        start = max(
            (float(r.columns["t"][0]) for r in recordings if r.columns["t"].size), default=0.0
        )
        end = min(
            (float(r.columns["t"][-1]) for r in recordings if r.columns["t"].size), default=0.0
        )
        if any(not r.columns["t"].size for r in recordings):
            end = start
        t = np.arange(start, end, STEP)
        names = [
            name for name in recordings[0].columns if all(name in r.columns for r in recordings)
        ]

        def on_grid(r: Recording, name: str) -> Floats:
            # If a recording is empty, so is the grid.
            return np.interp(t, r.columns["t"], r.columns[name]) if t.size else np.zeros(0)

        columns = {
            name: np.array([on_grid(r, name) for r in recordings]) for name in names if name != "t"
        }
        return cls(t, columns)

    @property
    def forces(self) -> Floats:
        """Force on each hand, shape (users, 3, n) [N]."""
        return np.stack([self.columns[c] for c in ("fx", "fy", "fz")], axis=1)

    @property
    def tips(self) -> Floats:
        """Position of each hand's tip, shape (users, 3, n) [m]."""
        return np.stack([self.columns[c] for c in ("x", "y", "z")], axis=1)

    @property
    def force(self) -> Floats:
        """Magnitude of the force on each hand, shape (users, n) [N]."""
        return np.asarray(np.linalg.norm(self.forces, axis=1))

    @property
    def felt(self) -> Floats:
        """Part of the force on each hand that is due to the other users, shape (users, n) [N]."""
        return np.asarray(self.columns["scale"] * self.columns["felt_from_others"])

    @property
    def ready(self) -> npt.NDArray[np.bool_]:
        """Whether all users get their full force and all but the first press fully, shape (n,)."""
        scale, level = self.columns["scale"], self.columns["level"]
        return np.asarray((scale >= 1.0).all(axis=0) & (level[1:] >= 1.0).all(axis=0))


def stretches(timeline: Timeline, *, pressed: bool, expected: float) -> list[slice]:
    """Return the intervals in which the first hand stays pressed, or stays off.

    Args:
        timeline: Recordings of all users.
        pressed: Whether to return the intervals with the hand pressed; if not, with the hand off.
        expected: Length of a complete interval [s]; intervals below 80 % of it are omitted.
    """
    level = timeline.columns["level"][0]
    held = (level >= 1.0 if pressed else level <= 0.0) & timeline.ready
    edges = np.flatnonzero(np.diff(np.concatenate([[0], held.astype(np.int8), [0]])))
    return [
        slice(start, end)
        for start, end in edges.reshape(-1, 2).tolist()
        if (end - start) * STEP >= 0.8 * expected
    ]


def measured(stretch: slice) -> slice:
    """Return the last part of a stretch, over which forces are averaged."""
    length = round(MEASURE / STEP)
    return slice(stretch.stop - min(length, (stretch.stop - stretch.start) // 2), stretch.stop)


def patch_rate(timeline: Timeline, user: int) -> float:
    """Return the patches per second that user number `user` (from 0) received; NaN without any."""
    tick = timeline.columns["tick"][user]
    received = tick > 0.0
    # Interpolation spreads a step of the tick over two samples: count changes of its integer part.
    seconds = float(received.sum()) * STEP
    return float((np.diff(np.floor(tick[received])) > 0).sum()) / seconds if seconds else math.nan


def mean_over(values: Floats, windows: Sequence[slice]) -> Floats:
    """Return the mean over all windows of values whose last axis is time; NaN without a window."""
    if not windows:
        return np.full(values.shape[:-1], np.nan)
    return np.asarray(np.concatenate([values[..., w] for w in windows], axis=-1).mean(axis=-1))


def press_windows(timeline: Timeline, *, injected: float) -> list[slice]:
    """Return a window for each press of the first hand, from `AROUND` before it until the release.

    Releases are omitted: a control law with an integral term reduces a force much faster than it
    builds up a force.

    Args:
        timeline: Recordings of all users.
        injected: Injected delay of a round trip [s].
    """
    level = timeline.columns["level"][0]
    moving = (level > 0.0) & (level < 1.0)
    starts = (np.flatnonzero(np.diff(moving.astype(np.int8)) == 1) + 1).tolist()
    before, least = round(AROUND / STEP), round((_AFTER + injected) / STEP)
    windows = [
        slice(start - before, end)
        for start, end in itertools.pairwise([*starts, len(level)])
        if start >= before and end - start >= least and level[start - 1] <= 0.0
    ]
    return [w for w in windows if timeline.ready[w].all()]
