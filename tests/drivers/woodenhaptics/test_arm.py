"""An arm on its serial link, in virtual time: which commands go out, and when."""

from __future__ import annotations

import pytest

from cohaptic.errors import DeviceError
from cohaptic.testing.manual_clock import ManualClock
from cohaptic.vec import ZERO, Vec3, norm
from cohaptic_client.loop.running.entry import Release
from cohaptic_drivers.woodenhaptics.arm import WoodenArm
from cohaptic_drivers.woodenhaptics.reports import Reported, command_line
from cohaptic_drivers.woodenhaptics.serial_link import SerialLink
from cohaptic_drivers.woodenhaptics.unit import UNITS

ANSWER = b"[3,0,0,0,0,0,0,0]\n"
PUSH: Vec3 = (100.0, -200.0, 300.0)
FORCE: Vec3 = (0.5, -1.0, 2.0)
PERIOD = 0.001  # s


class ScriptedPort:
    """A port that notes what is sent, and has what a test puts there.

    Attributes:
        answers: Whether each command is answered at once.
    """

    def __init__(self) -> None:
        self.sent = list[bytes]()
        self.answers = False
        self._waiting = b""

    def tell(self, counts: int) -> None:
        """The first encoder has gone so far; one is 0.05 mm at the tip."""
        self._waiting += f"[3,{counts},0,0,0,0,0,0]\n".encode()

    def read(self, size: int) -> bytes:
        data, self._waiting = self._waiting[:size], self._waiting[size:]
        return data

    def write(self, data: bytes) -> int:
        self.sent.append(data)
        if self.answers:
            self._waiting += ANSWER
        return len(data)

    def close(self) -> None:
        self.sent.append(b"close")


def linked() -> tuple[ScriptedPort, SerialLink, ManualClock]:
    port, clock = ScriptedPort(), ManualClock()
    return port, SerialLink(port, clock), clock


def test_a_command_waits_for_the_answer_to_the_one_before_and_not_for_long() -> None:
    port, link, clock = linked()
    link.send(PUSH)
    link.send(PUSH)
    assert port.sent == [command_line(PUSH)]
    clock.sleep_until(clock.now() + 0.006)  # however long the loop's own time stands
    link.send(PUSH)
    assert port.sent == [command_line(PUSH)] * 2


def test_another_thread_says_zero_at_once_whatever_was_said_before() -> None:
    port, link, _ = linked()
    link.send(PUSH)
    link.release()
    link.release()
    assert port.sent[1:] == [command_line(ZERO)] * 2


@pytest.mark.parametrize("answers", [True, False])
def test_at_the_end_the_hand_is_let_go_along_a_ramp(answers: bool) -> None:
    """Nobody reads the device then: `deflection` itself looks for answers."""
    port, link, clock = linked()
    arm = WoodenArm(UNITS["woodenhaptics"], link, Reported((0.0, 0.0, 0.0), model=3))
    arm.read(0.0)
    port.answers = answers
    arm.write(FORCE)
    Release(arm, clock, PERIOD)(FORCE)
    *ramp, last = (line for line in port.sent if line != b"close")
    sizes = [norm(tuple(map(float, line[1 : line.index(b"]")].split(b",")))) for line in ramp]  # type: ignore[arg-type]
    assert last == command_line(ZERO)
    assert sizes == sorted(sizes, reverse=True)
    assert sum(size > 0.0 for size in sizes) >= (18 if answers else 3)
    assert port.sent[-1] == b"close"


@pytest.mark.parametrize(
    ("silence", "counts", "jumps"),
    [(0.001, 500, False), (0.001, 1300, True), (0.15, 1300, False), (0.15, 6000, True)],
)
def test_a_hand_that_went_on_in_a_silence_of_the_board_has_not_jumped(
    silence: float, counts: int, jumps: bool
) -> None:
    """1300 counts are 60 mm: 0.4 m/s over 0.15 s, and no hand's way in a millisecond."""
    port, link, _ = linked()
    arm = WoodenArm(UNITS["woodenhaptics"], link, Reported((0.0, 0.0, 0.0), model=3))
    arm.read(0.0)
    port.tell(counts)
    if jumps:
        with pytest.raises(DeviceError, match="its encoders jumped"):
            arm.read(silence)
    else:
        assert arm.read(silence).position[0] == pytest.approx(4.8e-5 * counts, rel=0.1)


def test_a_process_that_stood_still_does_not_take_the_board_for_gone() -> None:
    """Its answer comes with the next command: nobody listened for a second."""
    port, link, _ = linked()
    arm = WoodenArm(UNITS["woodenhaptics"], link, Reported((0.0, 0.0, 0.0), model=3))
    arm.read(0.0)
    arm.read(0.001)
    arm.read(1.0)
    port.tell(100)
    assert arm.read(1.001).fresh
    for k in range(249):
        arm.read(1.001 + PERIOD * k)
    with pytest.raises(DeviceError, match="its board has been silent for 25"):
        arm.read(1.255)
