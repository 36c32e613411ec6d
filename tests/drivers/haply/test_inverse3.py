"""The driver in use against an emulator of its service, over a real websocket."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from threading import Thread

import pytest

from cohaptic.vec import ZERO, Vec3, add, cross, dot, norm
from cohaptic_client.devices.device import Device, DeviceSample
from cohaptic_client.devices.placing.placed import Placed
from cohaptic_drivers.haply import inverse3
from cohaptic_drivers.haply.exchange import GIVE_UP, SILENCE
from tests.client.devices.until import until
from tests.drivers.haply.emulator import REST, EmulatedArm
from tests.drivers.haply.haply_bench import CLOCK, PUSH, Bench

pytestmark = pytest.mark.live

ROUNDING = 1e-12


@pytest.fixture
def bench() -> Iterator[Bench]:
    made = Bench()
    yield made
    made.close()


def settled(
    device: Device, true: Callable[[DeviceSample], bool], force: Vec3 = ZERO
) -> DeviceSample:
    """The first sample of which it is true, under a force."""
    seen: list[DeviceSample] = []

    def found() -> bool:
        device.write(force)
        seen.append(device.read(CLOCK.now()))
        return true(seen[-1])

    until(found)
    return seen[-1]


def test_a_hand_is_seen_where_it_goes_and_pushed_where_the_force_points(bench: Bench) -> None:
    device = bench.open("place=center")
    assert device.info.name == "haply"
    assert device.read(0.0).position == pytest.approx(REST, abs=ROUNDING)

    def moves(sample: DeviceSample) -> bool:
        # Always ahead: a whole way may be over before a busy machine looks again.
        bench.arm.goal = add(bench.arm.state.position, (0.03, 0.02, -0.02))
        return norm(sample.velocity) > 0.01

    sample = settled(device, moves)
    assert sample.velocity[0] > 0.0
    assert sample.velocity[1] > 0.0
    assert sample.velocity[2] < 0.0
    bench.arm.goal = (0.03, 0.16, 0.19)
    settled(device, lambda s: abs(s.position[0] - 0.03) < 1e-4)
    bench.press(device)
    shift = PUSH[2] / bench.arm.hand.stiffness
    settled(device, lambda s: s.fresh and s.position[2] > 0.19 + 0.9 * shift, PUSH)


def assert_along_push(given: list[Vec3]) -> None:
    """Nothing but the force that was written, or less of it after a silence."""
    for force in given:
        assert norm(cross(force, PUSH)) < ROUNDING
        assert 0.0 <= dot(force, PUSH) <= dot(PUSH, PUSH) + ROUNDING


def test_a_grips_button_is_the_switch(bench: Bench) -> None:
    assert not bench.open().info.switch
    device = bench.open("grip=yes")
    assert device.info.switch
    bench.arm.button = True
    settled(device, lambda s: s.buttons == 1)
    bench.arm.button = False
    settled(device, lambda s: s.buttons == 0)


def test_the_grip_of_another_hand_is_not_the_switch(bench: Bench) -> None:
    bench.emulator.grips = {"61548": False, "70001": False}
    sentence = "haply: there are several grips: 61548, 70001; name one: haply:grip=ID"
    assert bench.complaint("grip=yes") == sentence
    assert bench.complaint("clutch=1") == sentence
    assert "there is no grip 5; the service has: 61548, 70001" in bench.complaint("grip=5")
    device = bench.open("grip=70001")
    assert device.info.switch
    bench.emulator.grips["61548"] = True  # it comes with the answers to come
    answers = len(bench.emulator.given) + 20
    settled(device, lambda s: s.buttons == 1 or len(bench.emulator.given) > answers)
    assert device.read(CLOCK.now()).buttons == 0
    bench.emulator.grips["70001"] = True
    settled(device, lambda s: s.buttons == 1)
    del bench.emulator.grips["70001"]  # out of reach: let go
    settled(device, lambda s: s.buttons == 0)


def test_closing_leaves_no_force(bench: Bench) -> None:
    device = bench.open()
    bench.press(device)
    device.close()
    until(lambda: bench.arm.force == ZERO)
    device.close()


def test_a_loop_that_stands_still_leaves_no_force(bench: Bench) -> None:
    device = bench.open()
    bench.press(device)
    until(lambda: bench.arm.force == ZERO)  # nobody reads or writes


def test_another_thread_can_take_the_force_away(bench: Bench) -> None:
    device = bench.open()
    bench.press(device)
    assert isinstance(device, Placed)
    Thread(target=device.release).start()
    until(lambda: bench.arm.force == ZERO)


def test_unplugged_in_contact(bench: Bench) -> None:
    device = bench.open()
    bench.press(device)
    bench.arm.plugged = False
    assert "device 049D was unplugged" in bench.end_of(device)


def test_power_lost_in_contact(bench: Bench) -> None:
    device = bench.open()
    bench.press(device)
    bench.arm.status["power_supply"] = False
    assert "plug its power supply in" in bench.end_of(device)
    until(lambda: bench.arm.force == ZERO)


@pytest.mark.parametrize(
    "garbage",
    [
        "no json",
        "[1, 2]",
        '{"inverse3": 5}',
        '{"inverse3": [{"device_id": "049D"}]}',
        '{"inverse3": [{"device_id": "049D", "state": {"cursor_position": {"x": 1e400}}}]}',
        "[" * 100_000,
    ],
)
def test_garbage_in_contact(bench: Bench, garbage: str) -> None:
    device = bench.open()
    bench.press(device)
    bench.emulator.instead = garbage
    assert "is no state of a device" in bench.end_of(device)
    until(lambda: bench.arm.force == ZERO)


def test_a_service_that_stalls_holds_no_force_and_is_given_up(
    bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    device = bench.open()
    bench.press(device)
    monkeypatch.setattr(inverse3, "SILENCE", SILENCE)
    bench.emulator.silent.set()
    stale = CLOCK.now() + SILENCE
    until(lambda: not device.read(CLOCK.now()).fresh or CLOCK.now() > stale + GIVE_UP)
    assert "silent" in (reported := bench.end_of(device)) or "not answered" in reported
    bench.emulator.silent.clear()
    until(lambda: bench.arm.force == ZERO)


def test_a_short_stall_is_survived_and_the_force_comes_back_slowly(
    bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    device = bench.open()
    bench.press(device)
    monkeypatch.setattr(inverse3, "SILENCE", SILENCE)
    bench.emulator.silent.set()
    until(lambda: not device.read(0.0).fresh)
    for k in range(1, 31):  # longer than the force takes to go
        device.read(0.001 * k)
    bench.emulator.silent.clear()
    until(lambda: device.read(0.03).fresh)
    device.write(PUSH)  # at the very time of the stall
    until(lambda: bench.arm.force == ZERO)
    monkeypatch.setattr(inverse3, "SILENCE", 20.0)  # what is slow from now on is this machine
    for k in range(4, 14):
        device.read(0.01 * k)

    def back() -> bool:
        device.write(PUSH)  # again and again, as the service holds none for long
        return bench.arm.force[2] == pytest.approx(0.2 * PUSH[2])

    until(back)


def test_the_service_is_killed_in_contact(bench: Bench) -> None:
    device = bench.open()
    bench.press(device)
    bench.emulator.drop()
    assert "the connection to the Haply service broke" in bench.end_of(device)


def test_two_devices_on_one_service_are_told_apart(bench: Bench) -> None:
    bench.emulator.arms["04A1"] = EmulatedArm("04A1")
    assert bench.complaint() == "haply: there are several: 049D, 04A1; choose one: haply:id=..."
    assert "there is no device 1234; the service has: 049D, 04A1" in bench.complaint("id=1234")
    left, right = bench.open("id=049D"), bench.open("id=04A1")
    bench.press(left)
    settled(right, lambda _: bench.emulator.arms["04A1"].force[2] == 1.0, (0.0, 0.0, 1.0))
    assert_along_push([force for _, name, force in bench.emulator.given if name == "049D"])
    bench.emulator.arms["04A1"].plugged = False
    assert "device 04A1 was unplugged" in bench.end_of(right)
    bench.press(left)
