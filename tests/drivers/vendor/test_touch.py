from __future__ import annotations

import math
import shutil
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from cohaptic.errors import DeviceError
from cohaptic.vec import ZERO
from cohaptic_client.devices.device import Device
from cohaptic_drivers.vendor import touch
from tests.client.devices.until import SteadyClock, until
from tests.drivers.vendor.vendor_bench import PUSH, Bench, make_bench

pytestmark = [
    pytest.mark.live,
    pytest.mark.skipif(sys.platform == "win32", reason="the stand-in is built for POSIX"),
]


CLOCK = SteadyClock()


@pytest.fixture
def bench(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Bench]:
    monkeypatch.setattr(touch, "GIVE_UP", 2.0)  # a machine that is busy with other tests
    yield from make_bench("touch", tmp_path)


def press(bench: Bench, device: Device) -> None:
    def given() -> bool:
        device.read(CLOCK.now())
        device.write(PUSH)
        return bench.force() == (1.0, 3.0, -2.0)  # right, up, toward the user

    until(given)


def test_axes_units_buttons_and_forces_are_those_of_the_user(bench: Bench) -> None:
    bench.put("position", (10.0, 20.0, 30.0))  # mm; right, up, toward the user
    bench.put("velocity", (100.0, 200.0, 300.0))
    bench.set("buttons", 2)
    device = bench.open("model=omni")
    sample = device.read(CLOCK.now())
    assert sample.position == pytest.approx((0.01, -0.03, 0.02))
    assert sample.velocity == pytest.approx((0.1, -0.3, 0.2))
    assert sample.buttons == 2
    assert bench.get("forces_on") == 1
    press(bench, device)
    device.close()
    assert bench.force() == ZERO
    assert bench.get("forces_on") == 0


def test_a_loop_that_stands_still_leaves_no_force(bench: Bench) -> None:
    device = bench.open()
    press(bench, device)
    until(lambda: bench.force() == ZERO)


def test_a_servo_thread_that_stalls_is_not_fresh_and_then_gone(bench: Bench) -> None:
    device = bench.open()
    press(bench, device)
    bench.set("stalled", 1)
    until(lambda: not device.read(CLOCK.now()).fresh)
    assert "its servo thread has been silent" in bench.end_of(device)


@pytest.mark.parametrize(
    ("code", "words"),
    [
        (0x0302, "does not answer any more"),
        (0x0200, "its motors are too warm"),
        (0x0999, "error 0x0999"),
    ],
)
def test_a_fault_in_contact_ends_without_force(bench: Bench, code: int, words: str) -> None:
    device = bench.open()
    press(bench, device)
    bench.set("error", code)
    assert words in bench.end_of(device)
    until(lambda: bench.force() == ZERO)
    bench.set("error", 0)


@pytest.mark.parametrize("value", [math.nan, math.inf, 5000.0])
def test_garbage_in_contact(bench: Bench, value: float) -> None:
    device = bench.open()
    press(bench, device)
    bench.put("position", (0.0, value, 0.0))
    assert "which cannot be" in bench.end_of(device)
    until(lambda: bench.force() == ZERO)


def test_two_devices_are_told_apart_by_the_names_of_their_setup(
    bench: Bench, tmp_path: Path
) -> None:
    """Each in a process of its own, and so with a library of its own: here a copy of the file."""
    (tmp_path / "other").mkdir()
    copied = shutil.copy(bench.path, tmp_path / "other")
    other = Bench("touch", Path(copied))
    one, two = bench.open("id=Left"), other.open("id=Right")
    assert (bench.opened_name(), other.opened_name()) == ("Left", "Right")
    press(other, two)
    assert bench.force() == ZERO
    one.close()
    two.close()
    assert other.force() == ZERO


def test_what_keeps_it_from_use_is_told(bench: Bench) -> None:
    bench.set("count", 0)
    reported = bench.complaint("id=Left")
    assert "OpenHaptics cannot open Left; plug it in, pair and calibrate it" in reported
    bench.set("count", 1)
    bench.set("stalled", 1)
    assert "the servo thread of OpenHaptics does not start" in bench.complaint()


def test_another_library_at_the_address_is_refused(bench: Bench) -> None:
    bench.path = Path("libc.so.6")
    with pytest.raises(DeviceError, match="has no function hdInitDevice"):
        bench.open()
