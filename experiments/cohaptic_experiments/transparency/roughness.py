"""How smooth the force of a resting hand is while another sways: what a network adds to the motion.

One hand sways at 1 Hz, the others rest, and the force of each is laid beside that of the same hands
without a network. A delay alone changes nothing of it; jitter, losses and late ticks make it rough.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.signal import butter, filtfilt

from cohaptic_experiments.transparency.motion import Wave
from cohaptic_experiments.transparency.scheme import AnyScheme
from cohaptic_experiments.transparency.setting import Setting
from cohaptic_experiments.virtual_session import PERIOD
from cohaptic_server.numeric import Floats

SWAY: Final = Wave(1.0, 0.004)
# Hz; a hand's own motion has hardly anything above it, and a finger feels a rattle best there.
FAST: Final = 12.0
_SETTLE = 1.5  # s from the start of the sway
_SECONDS = 6.0  # s for which forces are compared
_LONGEST = 0.9  # s; no link delays the felt force by more
_STEP = 5  # haptic periods from one offset in time that is tried to the next
_EDGE = 300  # haptic periods at both ends in which a filter has not settled
_WITHIN = 20  # haptic periods in which a change of a resting force counts
# N for a change of the offset by one step: an offset follows a delay that changes, not noise.
_STEADY = 0.01


@dataclass(frozen=True, slots=True)
class Roughness:
    """The force of a resting hand while another sways, beside that without a network.

    Args:
        swing, true_swing: Largest less least force [N].
        fast, true_fast: Force above 12 Hz [N rms].
        path: Sum of all changes of the force, over that without a network.
        late: Time by which the force is later [s], the constant one that fits best.
        off: What remains then [N rms].
        offset: Mean time offset where the offset may change [s] ...
        offset_range: ... and the largest less the least [s].
        value_offset: What remains then [N rms].
        at_rest: Largest change of a force within 20 ms while nobody moves [N].
    """

    swing: float
    true_swing: float
    fast: float
    true_fast: float
    path: float
    late: float
    off: float
    offset: float
    offset_range: float
    value_offset: float
    at_rest: float


def measure_roughness(
    setting: Setting, make: Callable[[], AnyScheme], true: Floats, hz: float = SWAY.frequency
) -> list[Roughness]:
    """Return how rough the force of each other hand is.

    Args:
        setting: Hands, body, link and lateness of ticks.
        make: Makes the scheme, which is played twice.
        true: Forces without a network, from `true_sway`, shape (users, t) [N].
        hz: Frequency of the sway [Hz].
    """
    begin, end = _span(setting)
    plans = setting.intentions((Wave(hz, SWAY.amplitude),))
    felt = setting.play(make(), plans, end)[1][:, begin:]
    still = setting.play(make(), setting.intentions(), end)[1][:, begin:]
    at_rest = np.abs(still[:, _WITHIN:] - still[:, :-_WITHIN]).max(axis=1).tolist()
    return [
        _roughness(x, y, rest) for x, y, rest in zip(felt[1:], true[1:], at_rest[1:], strict=True)
    ]


def true_sway(setting: Setting, hz: float = SWAY.frequency) -> Floats:
    """Return the forces of the same hands without a network, at the same times, (users, t) [N]."""
    begin, end = _span(setting)
    plans = setting.intentions((Wave(hz, SWAY.amplitude),))
    return setting.truth(plans, end).force[:, begin:]


def _span(setting: Setting) -> tuple[int, float]:
    """Return the first period that counts, and the end of the session [s]."""
    return round((setting.rests_at + _SETTLE) / PERIOD), setting.rests_at + _SETTLE + _SECONDS


def _roughness(felt: Floats, true: Floats, at_rest: float) -> Roughness:
    late, off = _constant_offset(felt, true)
    offsets, value = changing_offset(felt, true)
    return Roughness(
        swing=float(np.ptp(felt)),
        true_swing=float(np.ptp(true)),
        fast=_fast(felt),
        true_fast=_fast(true),
        path=float(np.abs(np.diff(felt)).sum() / np.abs(np.diff(true)).sum()),
        late=late,
        off=off,
        offset=float(offsets.mean()),
        offset_range=float(np.ptp(offsets)),
        value_offset=value,
        at_rest=at_rest,
    )


def _fast(force: Floats) -> float:
    b, a = butter(2, FAST * 2.0 * PERIOD, "high")
    return float(np.std(filtfilt(b, a, force)[_EDGE:-_EDGE]))


def _constant_offset(felt: Floats, true: Floats) -> tuple[float, float]:
    """Return the constant lateness that fits best [s], and what remains [N rms]."""
    n = len(true) - round(_LONGEST / PERIOD)
    off, late = min(
        (float(np.sqrt(np.mean((felt[d : d + n] - true[:n]) ** 2))), d)
        for d in range(0, len(true) - n, _STEP)
    )
    return PERIOD * late, off


def changing_offset(felt: Floats, true: Floats) -> tuple[Floats, float]:
    """Return the time offset that fits best where it may change, and what remains [N rms].

    Of all ways in which an offset can change by at most half of the time in which it changes, it is
    the one with the least sum of differences. So are the effective time and value offsets of Kroep
    et al. (arXiv 2107.05343) made, by dynamic time warping, whose slope is bounded in another way.

    Args:
        felt, true: Force with and without a network, at the same times, shape (t,) [N].

    Returns:
        Offset at each second step of the felt force [s], and what remains [N rms].
    """
    lags = np.arange(0, round(_LONGEST / PERIOD), _STEP)
    times = np.arange(int(lags[-1]), len(felt), 2 * _STEP)
    apart = np.abs(felt[times][:, None] - true[times[:, None] - lags[None, :]])
    cost, came_from = apart[0], list[Floats]()
    wall = np.full(1, np.inf)
    for row in apart[1:]:
        steps = np.stack(
            [
                np.concatenate([wall, cost[:-1]]) + _STEADY,
                cost,
                np.concatenate([cost[1:], wall]) + _STEADY,
            ]
        )
        best = steps.argmin(axis=0)
        came_from.append(np.asarray(best - 1))
        cost = np.take_along_axis(steps, best[None, :], axis=0)[0] + row
    path = [int(cost.argmin())]
    for back in reversed(came_from):
        path.append(path[-1] + int(back[path[-1]]))
    at = np.array(path[::-1])
    value = float(np.sqrt(np.mean(apart[np.arange(len(at)), at] ** 2)))
    return np.asarray(PERIOD * lags[at], dtype=np.float64), value
