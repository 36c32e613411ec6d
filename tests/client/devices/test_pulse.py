from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic.errors import DeviceError
from cohaptic.vec import ZERO, Vec3, norm, sub
from cohaptic_client.devices.device import DeviceInfo, DeviceSample
from cohaptic_client.devices.pulse import KNOCKS, LENGTH, STRENGTH, pulse, pulse_force

MOST_RATE = 20.0  # N/s; the safety layer's limit of changes that no motion of the hand causes


class Clock:
    def __init__(self) -> None:
        self.time = 5.0

    def now(self) -> float:
        return self.time

    def sleep_until(self, when: float) -> None:
        self.time = when


class Arm:
    def __init__(self, max_force: float, breaks_after: int = 10**6) -> None:
        self.info = DeviceInfo("arm", max_force, 100.0)
        self.given: list[Vec3] = []
        self.closed = False
        self._left = breaks_after

    def read(self, now: float) -> DeviceSample:
        self._left -= 1
        if self._left < 0:
            raise DeviceError("arm", "it was unplugged")
        return DeviceSample(ZERO, ZERO)

    def write(self, force: Vec3) -> None:
        self.given.append(force)

    def close(self) -> None:
        self.closed = True


@given(st.floats(-1.0, 3.0), st.floats(0.0, 0.01))
def test_a_knock_is_gentle(t: float, dt: float) -> None:
    assert norm(pulse_force(t)) <= STRENGTH
    assert norm(sub(pulse_force(t + dt), pulse_force(t))) <= MOST_RATE * dt + 1e-9


def test_it_knocks_as_often_as_it_says_and_ends_without_force() -> None:
    arm = Arm(3.0)
    pulse(arm, Clock())
    starts = [
        k for k in range(1, len(arm.given)) if arm.given[k] != ZERO and arm.given[k - 1] == ZERO
    ]
    assert len(starts) == KNOCKS
    assert arm.given[-1] == ZERO
    assert arm.closed
    assert LENGTH > 0.0


def test_what_only_senses_cannot_knock() -> None:
    arm = Arm(0.0)
    with pytest.raises(DeviceError, match="it only senses"):
        pulse(arm, Clock())
    assert arm.closed
    assert arm.given == []


def test_unplugged_in_a_knock_it_is_closed() -> None:
    arm = Arm(3.0, breaks_after=50)
    with pytest.raises(DeviceError, match="unplugged"):
        pulse(arm, Clock())
    assert arm.closed
