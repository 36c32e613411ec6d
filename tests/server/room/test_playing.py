"""What a hand does is read at one constant time, however late each sample comes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic.vec import Vec3
from cohaptic_server.room.playing import Samples
from cohaptic_server.world.state import Touch
from tests.server.touches import touch

GAP = 1.0 / 60.0
WAYS: tuple[Vec3, Vec3] = ((0.1, -0.2, 0.05), (1.0, 2.0, -3.0))  # m/s and N/s of a steady motion


def sample(t: float, seq: int, arrived: float, clock: float = 0.0) -> Touch:
    """What a hand that moves steadily tells at a time, on its own clock."""
    (vx, vy, vz), (fx, fy, fz) = WAYS
    return replace(
        touch(1),
        probe=(vx * t, vy * t, vz * t),
        force=(fx * t, fy * t, fz * t),
        deflection=0.01 * t,
        seq=seq,
        tick=seq,
        t_client=t + clock,
        arrived=arrived,
    )


def read(
    lateness: list[float], late_ticks: list[float], clock: float = 0.0
) -> list[tuple[float, Touch]]:
    """The times of ticks, and what they read; messages stay in order, as on TCP."""
    arrivals, last = list[tuple[float, Touch]](), 0.0
    for k, late in enumerate(lateness):
        last = max(last, GAP * k + late)
        arrivals.append((last, sample(GAP * k, k + 1, last, clock)))
    samples, found = Samples(), list[tuple[float, Touch]]()
    for k, late in enumerate(late_ticks):
        now = GAP * k + late + 0.3 * GAP
        while arrivals and arrivals[0][0] <= now:
            samples = samples.heard(arrivals.pop(0)[1])
        if samples.waiting:
            samples, one = samples.read(now)
            found.append((now, one))
    return found


lateness = st.lists(st.floats(0.0, 0.12), min_size=60, max_size=60)
late_ticks = st.lists(st.floats(0.0, 0.9 * GAP), min_size=60, max_size=60)


@given(lateness, late_ticks, st.floats(-100.0, 100.0))
def test_what_is_read_is_what_the_hand_did_at_a_time_that_only_goes_on(
    late: list[float], ticks: list[float], clock: float
) -> None:
    before = -np.inf
    for _, one in read(late, ticks, clock):
        t = one.t_client - clock
        (vx, vy, vz), (fx, fy, fz) = WAYS
        assert one.probe == pytest.approx((vx * t, vy * t, vz * t), abs=1e-9)
        assert one.force == pytest.approx((fx * t, fy * t, fz * t), abs=1e-9)
        assert one.deflection == pytest.approx(0.01 * t, abs=1e-9)
        # The patch that is answered is no newer than the sample whose time has come.
        assert one.tick <= t / GAP + 1.1 + 1e-9
        assert one.t_client >= before - 1e-9
        before = one.t_client


@given(st.lists(st.floats(0.0, 0.1), min_size=30, max_size=30), st.floats(-100.0, 100.0))
def test_once_the_link_is_known_the_delay_is_constant(late: list[float], clock: float) -> None:
    """A second of the link as it is, again and again."""
    found = read([*late, 0.1] * 12, [0.0] * 31 * 12, clock)
    ages = [now - one.t_client for now, one in found[-120:]]
    assert max(ages) - min(ages) <= 1e-6
    assert max(ages) <= 0.1 + 2.0 * GAP + clock * -1.0 + 1e-6


@given(st.floats(0.0, 0.2), st.floats(-100.0, 100.0))
def test_over_a_link_that_does_not_waver_the_newest_sample_is_read(
    delay: float, clock: float
) -> None:
    for now, one in read([delay] * 60, [0.0] * 60, clock)[-30:]:
        assert now - one.arrived < GAP + 1e-9


@given(st.lists(st.floats(allow_nan=False, allow_infinity=False), min_size=1, max_size=100))
def test_whatever_a_client_says_of_its_clock_something_is_read(stamps: list[float]) -> None:
    samples, now = Samples(), 0.0
    for k, t in enumerate(stamps):
        now += GAP
        samples = samples.heard(replace(sample(0.1 * k, k + 1, now), t_client=t))
        samples, one = samples.read(now)
        assert np.isfinite([*one.probe, *one.force, one.t_client]).all()
        assert 0 <= one.probe[0] <= 0.1 * 0.1 * k + 1e-12
        assert len(samples.waiting) <= 50


def test_a_clock_that_jumps_begins_anew_with_the_sample_that_came() -> None:
    samples = Samples()
    for k in range(100):
        samples = samples.heard(sample(GAP * k, k + 1, GAP * k + 0.1 * (k % 2)))
        samples, _ = samples.read(GAP * k + 0.1)
    jumped = replace(sample(1.7, 101, 1.75), t_client=1e6)
    samples, one = samples.heard(jumped).read(1.77)
    assert one == jumped
    assert len(samples.waiting) == 1
