from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cohaptic.simulated.hand import Hand, HandScript, Intention, Rhythm
from cohaptic.vec import ZERO, Vec3, is_finite, norm, sub
from cohaptic_client.devices.device import Device, DeviceSample
from cohaptic_client.devices.simulated import SimulatedDevice
from tests.examples_of_laws import examples

HAND = Hand()
PERIOD = 0.001  # s
RESTING = Intention(surface=(0.1, 0.0, 0.0), direction=(-1.0, 0.0, 0.0), depth=0.02)
PRESSING = HandScript(angle=0.3, rhythm=Rhythm(0.5), approach_at=0.1).intention(ZERO, 0.1)
ROUNDING = 1e-9  # m; positions of decimetres after some thousand steps in doubles


def run(device: Device, start: float, seconds: float, force: Vec3 = ZERO) -> DeviceSample:
    sample = device.read(start)
    for n in range(1, round(seconds / PERIOD) + 1):
        device.write(force)
        sample = device.read(start + n * PERIOD)
    return sample


def test_a_hand_that_waits_begins_when_it_is_engaged_and_no_second_time() -> None:
    now, waiting = SimulatedDevice(HAND, PRESSING), SimulatedDevice(HAND, PRESSING, waits=True)
    still = run(waiting, 0.0, 2.0)
    assert still == DeviceSample(PRESSING.position(0.0), ZERO, 0.0)
    waiting.engaged(2.0)
    first, later = run(now, 0.0, 0.4), run(waiting, 2.0, 0.4)
    assert norm(sub(first.position, later.position)) < ROUNDING
    assert later.level > 0.0
    waiting.engaged(2.4)
    assert run(waiting, 2.4, 0.1).level == pytest.approx(run(now, 0.4, 0.1).level, abs=1e-6)


@given(st.floats(-5.0, 5.0))
@settings(max_examples=examples(20))  # two seconds each
def test_it_comes_to_rest_where_its_spring_and_the_force_balance(force: float) -> None:
    sample = run(SimulatedDevice(HAND, RESTING), 0.0, 2.0, (force, 0.0, 0.0))
    expected = 0.1 - 0.02 + force / HAND.stiffness
    # Remainder of the swing after twenty times the hand's slowest time, 2 m / b.
    assert sample.position == pytest.approx((expected, 0.0, 0.0), abs=1e-6)
    assert sample.level == 1.0
    assert norm(sample.velocity) < 1e-4


@given(st.lists(st.integers(1, 100), min_size=1, max_size=8))
def test_how_often_it_is_read_changes_nothing_while_the_force_is_the_same(
    gaps: list[int],
) -> None:
    """Gaps of whole milliseconds: the steps of the integration are then the same ones."""
    often, seldom = SimulatedDevice(HAND, PRESSING), SimulatedDevice(HAND, PRESSING)
    often.read(0.0)
    seldom.read(0.0)
    now = 0
    for gap in gaps:
        for _ in range(gap):
            often.read((now := now + 1) * PERIOD)
        here, there = often.read(now * PERIOD), seldom.read(now * PERIOD)
        assert here.position == pytest.approx(there.position, abs=1e-6)


@given(st.lists(st.floats(-0.01, 0.2), max_size=30), st.floats(-10.0, 10.0))
def test_its_tip_stays_within_reach_at_any_irregular_reads(gaps: list[float], f: float) -> None:
    device, now = SimulatedDevice(HAND, PRESSING), 50.0
    device.read(now)
    device.write((0.0, f, 0.0))
    for gap in gaps:
        now += gap
        sample = device.read(now)
        assert is_finite(sample.position)
        assert is_finite(sample.velocity)
        # Twice the way to balance is the most that a swing reaches.
        assert norm(sample.position) < 0.15 + 2.0 * abs(f) / HAND.stiffness
