"""Recordings of a scene against its truth: forces, delays, stability. Pure functions of arrays."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from cohaptic_server.bodies.mesh import Floats
from cohaptic_server.demo.scene import MEASURE

STEP = 0.001  # s; grid on which recordings are laid side by side
_ALLOWED_RIPPLE = 0.1  # N peak to peak in a force that should be at rest, or
_ALLOWED_SHARE = 0.1  # this share of it, whichever is more
_AROUND = 0.5  # s before a press or release, at rest


@dataclass(frozen=True, eq=False)
class Recording:
    """One user's recording.

    Args:
        name: Of the user.
        columns: Each column of `cohaptic.record.Row`, shape (n,); `t` is Unix time [s].
    """

    name: str
    columns: dict[str, Floats]

    @classmethod
    def load(cls, path: Path) -> Recording:
        """Read what `cohaptic touch --record` wrote."""
        with np.load(path) as file:
            columns = dict(zip(file["columns"].tolist(), file["rows"].T, strict=True))
            columns["t"] = columns["t"] + float(file["to_wall"])
            return cls(str(file["name"]), columns)


@dataclass(frozen=True, eq=False)
class Timeline:
    """Recordings of all users on one time grid.

    Args:
        t: Grid [s], shape (n,).
        columns: Each column, one row per user, shape (users, n).
    """

    t: Floats
    columns: dict[str, Floats]

    @classmethod
    def of(cls, recordings: Sequence[Recording]) -> Timeline:
        """Lay recordings side by side where all of them exist."""
        start = max(
            (float(r.columns["t"][0]) for r in recordings if r.columns["t"].size), default=0.0
        )
        end = min(
            (float(r.columns["t"][-1]) for r in recordings if r.columns["t"].size), default=0.0
        )
        if any(not r.columns["t"].size for r in recordings):
            end = start
        t = np.arange(start, end, STEP)
        names = recordings[0].columns

        def on_grid(r: Recording, name: str) -> Floats:
            # Where a recording is empty the grid is too.
            return np.interp(t, r.columns["t"], r.columns[name]) if t.size else np.zeros(0)

        columns = {
            name: np.array([on_grid(r, name) for r in recordings]) for name in names if name != "t"
        }
        return cls(t, columns)

    @property
    def force(self) -> Floats:
        """Magnitude of the force on each hand, shape (users, n) [N]."""
        c = self.columns
        return np.asarray(np.sqrt(c["fx"] ** 2 + c["fy"] ** 2 + c["fz"] ** 2))

    @property
    def ready(self) -> npt.NDArray[np.bool_]:
        """Where every hand is engaged and all but the first are at rest in place, shape (n,)."""
        scale, level = self.columns["scale"], self.columns["level"]
        return np.asarray((scale >= 1.0).all(axis=0) & (level[1:] >= 1.0).all(axis=0))


def plateaus(timeline: Timeline, *, pressed: bool, expected: float) -> list[slice]:
    """The last part of each stretch in which the first hand intends to stay pressed, or off.

    Args:
        timeline: Of the scene.
        pressed: Which of the two.
        expected: Length of a whole stretch [s]; one that was cut short by a fifth is left out.
    """
    level = timeline.columns["level"][0]
    held = (level >= 1.0 if pressed else level <= 0.0) & timeline.ready
    edges = np.flatnonzero(np.diff(np.concatenate([[0], held.astype(np.int8), [0]])))
    found: list[slice] = []
    for start, end in edges.reshape(-1, 2).tolist():
        if (end - start) * STEP >= 0.8 * expected:
            length = min(MEASURE, 0.4 * expected)
            found.append(slice(end - round(length / STEP), end))
    return found


def patch_rate(timeline: Timeline, user: int) -> float:
    """Patches that came per second to a user, by its row; NaN without any."""
    tick = timeline.columns["tick"][user]
    here = tick > 0.0
    # Between two recorded periods a patch may come in part of the grid's step: count whole rises.
    seconds = float(here.sum()) * STEP
    return float((np.diff(np.floor(tick[here])) > 0).sum()) / seconds if seconds else math.nan


def mean_over(values: Floats, windows: Sequence[slice]) -> Floats:
    """Mean of each row over all windows; NaN without any."""
    if not windows:
        return np.full(len(values), np.nan)
    return np.asarray(np.concatenate([values[:, w] for w in windows], axis=1).mean(axis=1))


def ripple(values: Floats, windows: Sequence[slice]) -> Floats:
    """Largest peak to peak of each row within a window, about its straight line, else NaN."""
    worst = np.full(len(values), np.nan)
    for window in windows:
        part = values[:, window]
        x = np.linspace(-1.0, 1.0, part.shape[1])
        line = part.mean(axis=1)[:, None] + ((part @ x) / (x @ x))[:, None] * x
        worst = np.fmax(worst, np.ptp(part - line, axis=1))
    return worst


def is_still(force: Floats, windows: Sequence[slice], limit: float) -> list[bool | None]:
    """Whether each hand's force is at rest in all windows and never reached the limit.

    None where there is no window to judge from.
    """
    size, swing = mean_over(force, windows), ripple(force, windows)
    verdict: list[bool | None] = []
    for i in range(len(force)):
        if not windows:
            verdict.append(None)
        else:
            quiet = swing[i] <= max(_ALLOWED_RIPPLE, _ALLOWED_SHARE * size[i])
            verdict.append(bool(quiet and force[i].max() < 0.999 * limit))
    return verdict


def press_windows(timeline: Timeline, *, injected: float) -> list[slice]:
    """Around each press and each release: from before it until its news has come back."""
    level = timeline.columns["level"][0]
    moving = (level > 0.0) & (level < 1.0)
    starts = np.flatnonzero(np.diff(moving.astype(np.int8)) == 1)
    before, after = round(_AROUND / STEP), round((1.0 + injected) / STEP)
    windows = [slice(start - before, start + after) for start in starts.tolist()]
    return [
        w for w in windows if w.start >= 0 and w.stop <= len(timeline.t) and timeline.ready[w].all()
    ]


def felt_delay(felt: Floats, at_once: Floats, *, longest: float) -> float:
    """How late `felt` follows `at_once` [s].

    Args:
        felt: What a hand's loop had of the others, on the grid of `STEP`, shape (n,).
        at_once: What it would have had without a network, shape (n,).
        longest: Up to which the delay is looked for [s].
    """
    most = min(round(longest / STEP), len(felt) // 2)
    misfit = [
        float(np.square(felt[most:] - at_once[most - lag : len(felt) - lag]).mean())
        for lag in range(most)
    ]
    return float(np.argmin(misfit)) * STEP
