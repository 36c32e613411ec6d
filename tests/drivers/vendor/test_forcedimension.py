from __future__ import annotations

import math
import sys
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from cohaptic.errors import DeviceError
from cohaptic.vec import ZERO
from cohaptic_client.loop.running.watchdog import Watchdog
from tests.client.devices.until import until
from tests.drivers.vendor.vendor_bench import CLOCK, PUSH, Bench, make_bench

pytestmark = [
    pytest.mark.live,
    pytest.mark.skipif(sys.platform == "win32", reason="the stand-in is built for POSIX"),
]


@pytest.fixture
def bench(tmp_path: Path) -> Iterator[Bench]:
    yield from make_bench("forcedimension", tmp_path)


def test_axes_buttons_and_forces_are_those_of_the_user(bench: Bench) -> None:
    bench.put("position", (0.01, 0.02, 0.03))  # toward the user, right, up
    bench.put("velocity", (0.1, 0.2, 0.3))
    bench.set("buttons", 1)
    device = bench.open("model=omega")
    sample = device.read(CLOCK.now())
    assert sample.position == pytest.approx((0.02, -0.01, 0.03))
    assert sample.velocity == pytest.approx((0.2, -0.1, 0.3))
    assert sample.buttons == 1
    device.write(PUSH)
    assert bench.force() == (-2.0, 1.0, 3.0)
    assert bench.get("forces_on") == 1
    device.close()
    assert bench.force() == ZERO
    assert bench.get("forces_on") == 0
    assert bench.get("opened") == 0


@pytest.mark.parametrize("result", [1, 2])
def test_an_old_value_and_motors_at_their_limit_are_no_faults(bench: Bench, result: int) -> None:
    bench.set("result", result)
    device = bench.open()
    device.read(CLOCK.now())
    device.write(PUSH)


def test_unplugged_in_contact(bench: Bench) -> None:
    device = bench.open()
    device.write(PUSH)
    bench.set("gone", 1)
    assert "it is gone (communication error); see to its cable" in bench.end_of(device)
    device.close()


@pytest.mark.parametrize("value", [math.nan, math.inf, 5.0])
def test_garbage_in_contact(bench: Bench, value: float) -> None:
    device = bench.open()
    bench.put("position", (value, 0.0, 0.0))
    assert "which cannot be" in bench.end_of(device)


def test_what_is_no_force_is_none(bench: Bench) -> None:
    device = bench.open()
    device.write((math.nan, 0.0, 0.0))
    assert bench.force() == ZERO


def test_two_devices(bench: Bench) -> None:
    assert "there is no device 2; devices are 1 to 1" in bench.complaint("number=2")
    bench.set("count", 2)
    one, two = bench.open("number=1"), bench.open("number=2")
    two.write(PUSH)
    assert bench.force(0) == ZERO
    assert bench.force(1) == (-2.0, 1.0, 3.0)
    one.close()
    two.read(CLOCK.now())


def test_its_firmware_switches_the_forces_off_when_the_program_is_gone(bench: Bench) -> None:
    """The only thing that does after `kill -9`: the library holds the last force for ever."""
    device = bench.open()
    assert bench.watchdog() * 125e-6 == device.info.lets_go == 0.03
    assert bench.get("expert") == 0
    device.close()
    assert bench.watchdog() == 7  # as it was for other programs


def test_after_a_stall_the_forces_that_its_firmware_switched_off_come_on_again(
    bench: Bench,
) -> None:
    device = bench.open()
    assert bench.get("enabled") == 1
    CLOCK.sleep_until(CLOCK.now() + 0.05)
    device.read(CLOCK.now())
    device.write(ZERO)
    assert bench.get("enabled") == 2


def test_a_device_whose_firmware_has_no_watchdog_says_that_it_holds_its_force(
    bench: Bench,
) -> None:
    bench.set("refuses", 1)
    assert bench.open().info.lets_go == math.inf
    assert bench.watchdog() == 7


def test_a_library_that_stalls_in_contact_is_let_go_by_the_watchdog(bench: Bench) -> None:
    device: Any = bench.open()
    device.write(PUSH)
    assert bench.force() != ZERO
    ends: list[int] = []  # of this process, where this machine stands still for long
    watchdog = Watchdog(device, CLOCK, 0.02, ends.append)
    watchdog.start()
    watchdog.begin()
    bench.set("stalled", 1)
    reading = threading.Thread(target=lambda: device.read(CLOCK.now()))
    reading.start()
    until(lambda: bench.force() == ZERO)
    assert reading.is_alive()
    assert watchdog.fired
    watchdog.stop()
    bench.set("stalled", 0)
    reading.join()


def test_what_keeps_it_from_use_is_told(bench: Bench) -> None:
    bench.set("count", 0)
    assert "its library finds no device; plug it in and switch its power on" in bench.complaint()
    bench.set("count", 1)
    bench.set("gone", 1)
    assert "it cannot be opened (communication error)" in bench.complaint()


def test_another_library_at_the_address_is_refused(bench: Bench) -> None:
    bench.path = Path("libc.so.6")
    with pytest.raises(DeviceError, match="has no function dhdOpenID"):
        bench.open()
