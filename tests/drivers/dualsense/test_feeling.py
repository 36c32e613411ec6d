from __future__ import annotations

import math

from hypothesis import given
from hypothesis import strategies as st

from cohaptic.vec import ZERO, Vec3
from cohaptic_drivers.dualsense.feeling import NOTHING_FELT, Feeling, felt
from cohaptic_drivers.dualsense.reports import OFF

INWARD: Vec3 = (0.0, 1.0, 0.0)
FULL = 3.0  # N
PERIOD = 0.001  # s
number = st.floats(allow_nan=True, allow_infinity=True)
newtons = st.floats(-20.0, 20.0)
pulls = st.integers(0, 255)


def after(forces: list[tuple[Vec3, int]], start: Feeling = NOTHING_FELT) -> Feeling:
    feeling = start
    for k, (force, pull) in enumerate(forces):
        feeling = felt(
            feeling, force, pull=pull, inward=INWARD, full=FULL, now=(start.now or 0.0) + k * PERIOD
        )
    return feeling


@given(st.lists(st.tuples(st.tuples(number, number, number), pulls), max_size=20))
def test_whatever_the_force_effects_are_bytes(forces: list[tuple[Vec3, int]]) -> None:
    effects = after(forces).effects
    assert 0 <= effects.start <= 255
    assert 0 <= effects.resistance <= 255
    assert 0 <= effects.rumble <= 255


@given(st.floats(0.1, 20.0), st.floats(0.1, 20.0), pulls)
def test_a_larger_force_against_the_pull_resists_no_less(a: float, b: float, pull: int) -> None:
    low, high = sorted((a, b))
    weak = after([((0.0, -low, 0.0), pull)]).effects
    strong = after([((0.0, -high, 0.0), pull)]).effects
    assert 0 < weak.resistance <= strong.resistance
    assert (high >= FULL) <= (strong.resistance == 255)


@given(st.lists(pulls, min_size=1, max_size=10))
def test_resistance_begins_no_further_in_than_where_the_contact_did(way: list[int]) -> None:
    push: Vec3 = (0.0, -1.0, 0.0)
    effects = after([(push, pull) for pull in way]).effects
    assert effects.start == min(way)
    lifted = after([(push, 90), (ZERO, 10), (push, 200)]).effects
    assert lifted.start == 200


@given(st.tuples(newtons, newtons, newtons), pulls)
def test_a_force_that_stays_does_not_rumble_and_none_is_off(force: Vec3, pull: int) -> None:
    steady = after([(force, pull)] * 500)
    assert steady.effects.rumble == 0
    assert after([(ZERO, pull)] * 500, steady).effects == OFF


def test_a_force_that_cannot_be_leaves_nothing_behind() -> None:
    for number in (1e308, -1e308, 1e200, math.inf, math.nan):
        wild = after([((number, number, -number), 100)] * 3)
        assert wild.effects == OFF
        assert after([(ZERO, 0)], wild).effects == OFF
