from __future__ import annotations

import signal

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic.errors import DeviceError
from cohaptic.vec import ZERO, Vec3, norm, scale, sub
from cohaptic_client.devices.device import DeviceInfo, DeviceSample
from cohaptic_client.devices.pulse import STRENGTH, pulse, pulse_force, verdict
from tests.still_clock import StillClock

MAX_RATE = 20.0  # N/s; the safety layer's limit of changes that no motion of the hand causes


class Arm:
    """An arm on a spring; it yields to what it is given, or away from that."""

    def __init__(
        self, max_force: float, breaks_after: int = 10**6, *, yields: float = 1.0 / 400.0
    ) -> None:
        self.info = DeviceInfo("arm", max_force, 100.0)
        self.yields = yields  # m/N
        self.given: list[Vec3] = []
        self.closed = False
        self._left = breaks_after

    def read(self, now: float) -> DeviceSample:
        self._left -= 1
        if self._left < 0:
            raise DeviceError("arm", "it was unplugged")
        return DeviceSample(scale(self.given[-1], self.yields) if self.given else ZERO, ZERO)

    def write(self, force: Vec3) -> None:
        self.given.append(force)

    def close(self) -> None:
        self.closed = True


@given(st.floats(-1.0, 3.0), st.floats(0.0, 0.01))
def test_a_knock_is_gentle(t: float, dt: float) -> None:
    assert norm(pulse_force(t)) <= STRENGTH
    assert norm(sub(pulse_force(t + dt), pulse_force(t))) <= MAX_RATE * dt + 1e-9


def test_what_only_senses_cannot_knock() -> None:
    arm = Arm(0.0)
    with pytest.raises(DeviceError, match="it only senses"):
        pulse(arm, StillClock())
    assert arm.closed
    assert arm.given == []


def test_unplugged_in_a_knock_it_is_closed() -> None:
    arm = Arm(3.0, breaks_after=50)
    with pytest.raises(DeviceError, match="unplugged"):
        pulse(arm, StillClock())
    assert arm.closed


def test_a_weak_device_is_not_asked_for_more_than_it_has() -> None:
    arm = Arm(0.1)
    pulse(arm, StillClock())
    assert max(norm(force) for force in arm.given) == pytest.approx(0.1, rel=1e-3)


def test_an_arm_that_moves_against_its_knocks_would_pull_a_hand_in() -> None:
    ways = pulse(Arm(3.0, yields=-1.0 / 400.0), StillClock())
    with pytest.raises(DeviceError, match=r"against each of its knocks, by 1\.0 mm.*try again"):
        verdict("arm", ways)


@pytest.mark.parametrize(
    ("yields", "words"),
    [
        (1.0 / 400.0, "with each of its knocks, by 1.0 mm"),
        (0.0, "too little to tell"),
        (-1e-4, "too little to tell"),
    ],
)
def test_an_arm_that_moves_along_or_not_at_all_is_no_fault(yields: float, words: str) -> None:
    assert words in verdict("arm", pulse(Arm(3.0, yields=yields), StillClock()))


def test_told_to_end_in_a_knock_it_lets_go_first() -> None:
    ended: list[tuple[Vec3, bool]] = []

    class Interrupted(Arm):
        def write(self, force: Vec3) -> None:
            super().write(force)
            if len(self.given) == 60:
                signal.raise_signal(signal.SIGTERM)

    def end(_number: int, _frame: object) -> None:
        ended.append((arm.given[-1], arm.closed))

    arm = Interrupted(3.0)
    before = signal.signal(signal.SIGTERM, end)
    try:
        pulse(arm, StillClock())
    finally:
        signal.signal(signal.SIGTERM, before)
    assert len(arm.given) == 61
    assert norm(arm.given[59]) > 0.4
    assert ended == [(ZERO, False)]  # it has no force when the signal does what it does
    assert arm.closed
