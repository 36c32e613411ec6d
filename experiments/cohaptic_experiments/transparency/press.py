"""A press as another feels it: when a tenth, half and nine tenths of it are there.

The first hand presses further, all others rest. Each session is played twice with the same seeds,
with and without the press, and so are the same hands without a network. The difference of the two
sessions is what the press changes. Its delay is reckoned level by level (`lateness`), against the
difference of the two plays without a network; no recorded force or tip takes part in the truth.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from cohaptic_experiments.transparency.scheme import AnyScheme
from cohaptic_experiments.transparency.setting import Setting
from cohaptic_experiments.virtual_session import PERIOD
from cohaptic_server.numeric import Floats
from cohaptic_tools.demo.lateness import Late, late, passed

FURTHER = 0.008  # m of the press; it changes the force on a hand opposite by about 0.6 N
SETTLED = 0.1  # share of the final change within which a force has come to rest
_LEAST = 1e-3  # N; a smaller change is none
_BEFORE = 0.3  # s before the press, in which the change is zero
_SECONDS = 1.5  # s for which a press is watched, beside the ways that it takes
_ROUNDS = 6.0  # ways that a press is watched for
_END = 0.2  # s over which the final change is averaged


class Press(NamedTuple):
    """A press as one hand feels it.

    Args:
        passed: Times after the press at which the change passes its levels, shape (9,) [s].
        settled: Time after the press from which on the change stays within `SETTLED` of its final
            value [s]; NaN if it does not.
        change: Final change of the force [N].
    """

    passed: Floats
    settled: float
    change: float


def press_of(change: Floats, before: int) -> Press:
    """Return the times of a change of force.

    Args:
        change: Change of the force, one value for each haptic period, shape (n,) [N].
        before: Number of values before the press.
    """
    t = PERIOD * (np.arange(len(change), dtype=np.float64) - before)
    final = float(change[-round(_END / PERIOD) :].mean())
    off = np.flatnonzero(np.abs(change[before:] - final) > SETTLED * abs(final))
    settled = PERIOD * (float(off[-1]) + 1.0) if len(off) else 0.0
    if settled > t[-1] - _END:
        settled = math.nan
    return Press(passed(t, change, _LEAST), settled, final)


class Delayed(NamedTuple):
    """Delays with which one hand feels the press of the first, and the size of the change.

    Args:
        late: Delays of the shares of the change.
        settled: Time after the press from which on the change stays near its final value [s].
        change: Final change of the force [N].
        true_change: Final change of the force without a network [N].
    """

    late: Late
    settled: float
    change: float
    true_change: float


def delayed(felt: Press, true: Press) -> Delayed:
    """Compare a felt press with the same press without a network."""
    return Delayed(late(felt.passed, true.passed), felt.settled, felt.change, true.change)


def felt_presses(
    setting: Setting, make: Callable[[], AnyScheme], further: float = FURTHER
) -> list[Press]:
    """Return a press as each other hand feels it under a scheme.

    Args:
        setting: Hands, body and link.
        make: Makes the scheme, which is played twice.
        further: Depth of the press [m].
    """
    forces = [
        setting.play(make(), setting.intentions(further=depth), _end(setting))[1]
        for depth in (further, 0.0)
    ]
    return _presses(setting, forces[0] - forces[1])


def true_presses(setting: Setting, further: float = FURTHER) -> list[Press]:
    """Return the same without a network, whatever the setting's link."""
    setting = setting.without_network()
    forces = [
        setting.truth(setting.intentions(further=depth), _end(setting)).force
        for depth in (further, 0.0)
    ]
    return _presses(setting, forces[0] - forces[1])


def _end(setting: Setting) -> float:
    return setting.rests_at + _SECONDS + _ROUNDS * setting.link.delay


def _presses(setting: Setting, change: Floats) -> list[Press]:
    before = round(_BEFORE / PERIOD)
    begin = round(setting.rests_at / PERIOD) - before
    return [press_of(row[begin:], before) for row in change[1:]]
