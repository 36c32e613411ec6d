from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cohaptic_server.numeric import Floats
from cohaptic_tools.demo.analysis import STEP
from cohaptic_tools.demo.rest import (
    AT_LIMIT,
    RIPPLE,
    RIPPLE_FRACTION,
    Rest,
    judge,
    judge_stretch,
    reaches_limit,
)
from tests.examples_of_laws import examples

LIMIT = 10.0  # N
SECONDS = 4.0  # of a stretch
END = 0.6  # s of it that are measured
SIZE = 3.0  # N


def grid() -> Floats:
    return np.arange(0.0, SECONDS, STEP)


def end(stretch: slice) -> slice:
    return slice(stretch.stop - round(END / STEP), stretch.stop)


WHOLE = slice(0, len(grid()))


def found(force: Floats) -> Rest:
    return judge_stretch(force, force[end(WHOLE)])


def wave(amplitude: float | Floats, hz: float = 4.0, size: float = SIZE) -> Floats:
    return np.asarray(size + amplitude * np.sin(2.0 * np.pi * hz * grid()))


@given(st.floats(0.0, 9.0), st.floats(0.0, 0.49))
def test_a_force_at_rest_may_ripple_by_less_than_a_finger_feels(
    size: float, fraction: float
) -> None:
    """By `RIPPLE`, or `RIPPLE_FRACTION` of itself, peak to peak."""
    allowed = max(RIPPLE, RIPPLE_FRACTION * size)
    assert found(wave(fraction * allowed, size=size)) is Rest.RESTS


@given(st.floats(0.0, 9.0), st.floats(0.55, 20.0), st.floats(2.0, 12.0))
@settings(max_examples=examples(40))
def test_one_that_ripples_more_without_dying_is_unstable(
    size: float, fraction: float, hz: float
) -> None:
    allowed = max(RIPPLE, RIPPLE_FRACTION * size)
    assert found(wave(fraction * allowed, hz, size)) is Rest.UNSTABLE


@given(st.floats(0.5, 3.0), st.floats(3.0, 10.0))
def test_a_swing_that_grows_is_unstable(rate: float, hz: float) -> None:
    amplitude = 0.05 * np.exp(rate * (grid() - SECONDS))
    assert found(wave(amplitude, hz)) is Rest.UNSTABLE


@given(st.floats(1.5, 5.0), st.floats(1.5, 2.5), st.sampled_from([-1.0, 1.0]))
def test_a_force_that_creeps_to_its_value_is_slow(time: float, way: float, sign: float) -> None:
    assert found(SIZE + sign * way * np.exp(-grid() / time)) is Rest.SLOW


@pytest.mark.parametrize("hz", [1.5, 3.0])
def test_a_swing_that_dies_out_is_slow_as_long_as_it_lasts(hz: float) -> None:
    """Each swing 0.7 of the one before: late, and no reason to fear."""
    dying = 8.0 * 0.7 ** (2.0 * hz * grid())
    assert found(wave(dying, hz)) in (Rest.SLOW, Rest.RESTS)
    # Where it is still far from rest when measured.
    assert found(wave(dying * 0.7 ** (-2.0 * hz * 2.5), hz)) is Rest.SLOW


def test_what_a_press_leaves_behind_does_not_make_a_lasting_swing_die() -> None:
    """A large first swing, then one that stays."""
    force = wave(0.3, 3.0)
    force[: len(force) // 2 + 150] += 4.0
    assert found(force) is Rest.UNSTABLE


def test_where_something_came_late_a_force_may_rest_but_is_not_accused() -> None:
    """The first force swings in its second stretch, the other two always."""
    rests, slow, swinging = wave(0.0), SIZE + np.exp(-0.5 * grid()), wave(0.2)
    later = slice(WHOLE.stop, 2 * WHOLE.stop)
    pairs = ((rests, swinging), (swinging, slow), (swinging, swinging))
    forces = np.array([[*a, *b] for a, b in pairs])
    late = judge(forces, [WHOLE, later], [None, None], end)
    assert late == [Rest.RESTS, None, None]
    half = judge(forces, [WHOLE, later], [None, later], end)
    assert half == [Rest.UNSTABLE, Rest.SLOW, Rest.UNSTABLE]


def test_one_that_had_all_that_the_device_gives_is_unstable() -> None:
    """Where everything came on time: in a stretch, or wherever it was if all did."""
    force = wave(0.0)
    force[1000:1010] = 1.001 * AT_LIMIT * LIMIT
    assert reaches_limit(force, [WHOLE], LIMIT, always=False)
    assert not reaches_limit(force, [slice(1010, WHOLE.stop), None], LIMIT, always=False)
    assert reaches_limit(force, [None], LIMIT, always=True)
    force[1000:1010] = 0.99 * AT_LIMIT * LIMIT
    assert not reaches_limit(force, [WHOLE], LIMIT, always=True)
