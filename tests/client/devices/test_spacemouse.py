"""Laws of the SpaceMouse driver on a transport that a test fills with reports."""

from __future__ import annotations

import sys
from collections.abc import Iterable
from types import SimpleNamespace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic.errors import DeviceError
from cohaptic.vec import ZERO, norm, scale, sub
from cohaptic_client.devices.spacemouse import open_spacemouse
from tests.client.devices.spacemouse_cases import (
    CENTER,
    MAX_GAP,
    MAX_SPEED,
    PERIOD,
    REACH,
    ROUNDING,
    SILENCE,
    FakeTransport,
    any_report,
    counts,
    mouse_on,
    report,
)


@given(st.lists(st.tuples(st.lists(any_report, max_size=3), st.floats(-0.1, 10.0)), max_size=40))
def test_the_tip_stays_in_its_cube_and_below_its_speed(
    periods: list[tuple[list[list[int]], float]],
) -> None:
    transport = FakeTransport()
    reach = 0.004  # m; two periods at full speed lead from wall to wall
    mouse = mouse_on(transport, reach)
    now, last = 0.0, mouse.read(0.0)
    for reports, dt in periods:
        transport.reports.extend(reports)
        now += dt
        sample = mouse.read(now)
        gap = max(0.0, min(dt, MAX_GAP))
        for axis in range(3):
            assert abs(sample.position[axis] - CENTER[axis]) <= reach + ROUNDING
            assert abs(sample.velocity[axis]) <= MAX_SPEED
            moved = sample.position[axis] - last.position[axis]
            assert abs(moved) <= MAX_SPEED * gap + ROUNDING
            # A wall may stop the tip earlier, and then nothing moves on.
            if sample.velocity[axis] != 0.0:
                assert moved == pytest.approx(sample.velocity[axis] * gap, abs=ROUNDING)
        last = sample


@given(counts.filter(lambda c: c[1] < -20), st.integers(1, 100))
def test_the_last_deflection_holds_between_two_reports(
    deflection: tuple[int, int, int], periods: int
) -> None:
    mouse = mouse_on(FakeTransport([report(1, *deflection)]))
    start = mouse.read(0.0)
    sample = start
    for n in range(1, periods + 1):
        sample = mouse.read(n * PERIOD)
    assert sample.velocity == start.velocity != ZERO
    way = scale(start.velocity, periods * PERIOD)
    assert norm(sub(sub(sample.position, start.position), way)) < ROUNDING


@given(counts.filter(lambda c: c[1] < -20), st.floats(PERIOD, 3.0))
def test_a_deflected_cap_that_is_not_heard_stands_and_is_not_fresh(
    deflection: tuple[int, int, int], period: float
) -> None:
    transport = FakeTransport([report(1, *deflection)])
    mouse = mouse_on(transport, reach=1.0)
    sample, periods = mouse.read(0.0), 0
    assert sample.fresh
    # What counts is the time in which the process ran: one that was stopped has heard nothing.
    while sample.fresh and periods < 1000:
        periods += 1
        sample = mouse.read(periods * period)
    assert SILENCE < periods * min(period, MAX_GAP) <= SILENCE + 2.0 * min(period, MAX_GAP)
    assert sample.velocity == ZERO
    assert mouse.read((periods + 1) * period).position == sample.position
    transport.reports += [report(2, 300, 300, 300), report(1, *deflection)]
    awake = mouse.read((periods + 2) * period)
    assert awake.fresh
    assert awake.velocity != ZERO


@given(st.lists(counts, min_size=1, max_size=40))
def test_the_newest_deflection_wins(deflections: list[tuple[int, int, int]]) -> None:
    burst = FakeTransport()
    for deflection in deflections:
        burst.reports += [report(1, *deflection), report(2, 1, 2, 3), [3, 1]]
    mouse = mouse_on(burst)
    newest = mouse_on(FakeTransport([report(1, *deflections[-1])]))
    assert mouse.read(0.0) == newest.read(0.0)
    assert (mouse.skipped, newest.skipped) == (len(deflections) - 1, 0)
    assert not burst.reports


def test_a_device_that_never_stops_talking_does_not_hold_the_loop() -> None:
    class Chatterbox(FakeTransport):
        def read(self, max_length: int, /) -> list[int]:
            self.closed += 1
            assert self.closed < 1000, "the driver never stops reading"
            return report(1, 0, -350, 0)

    assert mouse_on(Chatterbox()).read(0.0).velocity == (0.0, MAX_SPEED, 0.0)


def test_unplugging_is_a_device_error_with_advice() -> None:
    transport = FakeTransport([report(1, 0, -350, 0)])
    mouse = mouse_on(transport)
    mouse.read(0.0)
    transport.plugged = False
    with pytest.raises(DeviceError, match=r"unplugged \(read error\); plug it in again"):
        mouse.read(PERIOD)
    mouse.close()
    assert transport.closed == 1


class FakeHid(FakeTransport):
    """A module of hidapi and the device it makes, in one; only `openable` paths open."""

    def __init__(
        self, entries: list[tuple[str, int, int, int, int]], openable: Iterable[str] = ()
    ) -> None:
        super().__init__([report(1, 0, -350, 0)])
        self.entries = entries
        self.openable = set(openable)
        self.opened: list[str] = []
        self.nonblocking = 0

    def enumerate(self, vendor_id: int) -> list[dict[str, object]]:
        names = ("path", "vendor_id", "product_id", "usage_page", "usage")
        return [
            dict(zip(names, entry, strict=True)) for entry in self.entries if entry[1] == vendor_id
        ]

    def device(self) -> FakeHid:
        return self

    def open_path(self, path: str) -> None:
        if path not in self.openable:
            raise OSError("open failed")
        self.opened.append(path)

    def set_nonblocking(self, on: int) -> int:
        self.nonblocking = on
        return 0


def install(monkeypatch: pytest.MonkeyPatch, *, hidraw: object, hid: object) -> None:
    """Put two things, None for nothing, where the driver looks for hidapi."""
    monkeypatch.setitem(sys.modules, "hidraw", hidraw)
    monkeypatch.setitem(sys.modules, "hid", hid)


@pytest.mark.parametrize("other", [None, SimpleNamespace(Device=object, enumerate=list)])
def test_without_hidapi_a_sentence_says_what_to_install(
    monkeypatch: pytest.MonkeyPatch, other: object
) -> None:
    """Nothing is called `hid`, or the other package of that name is."""
    install(monkeypatch, hidraw=None, hid=other)
    with pytest.raises(DeviceError, match=r"hidapi is missing, or hidden .*; run: pip"):
        open_spacemouse(CENTER, reach=REACH)


def test_only_the_cap_of_a_spacemouse_is_opened(monkeypatch: pytest.MonkeyPatch) -> None:
    entries = [
        ("mouse of Logitech", 0x046D, 0xC077, 1, 2),
        ("product of Logitech whose kind is unknown", 0x046D, 0xC077, 0, 0),
        ("receiver's keyboard", 0x256F, 0xC652, 1, 6),
        ("someone else's", 0x1234, 0xC635, 1, 8),
        ("in use", 0x256F, 0xC62E, 1, 8),
        ("cap", 0x256F, 0xC652, 1, 8),
    ]
    everything_else = [path for path, *_ in entries if path != "in use"]
    hid = FakeHid(entries, everything_else)
    install(monkeypatch, hidraw=hid, hid=None)
    mouse = open_spacemouse(CENTER, reach=REACH, max_speed=0.1)
    assert hid.opened == ["cap"]
    assert hid.nonblocking
    assert mouse.read(0.0).velocity == (0.0, 0.1, 0.0)


@pytest.mark.parametrize(
    ("vendor", "product", "usage"),
    [(0x256F, product, (1, 8)) for product in (0xC62F, 0xC631, 0xC636, 0xFFFF)]
    + [(0x046D, 0xC628, (1, 8)), (0x046D, 0xC628, (0, 0)), (0x256F, 0xC631, (0, 0))],
)
def test_a_cap_is_known_by_its_vendor_and_its_kind_and_needs_no_list(
    monkeypatch: pytest.MonkeyPatch, vendor: int, product: int, usage: tuple[int, int]
) -> None:
    hid = FakeHid([("cap", vendor, product, *usage)], ["cap"])
    install(monkeypatch, hidraw=hid, hid=None)
    open_spacemouse(CENTER, reach=REACH).close()
    assert hid.opened == ["cap"]


def test_without_the_right_to_open_it_a_rule_for_udev_is_named(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    install(monkeypatch, hidraw=FakeHid([("cap", 0x046D, 0xC626, 1, 8)]), hid=None)
    with pytest.raises(DeviceError) as caught:
        open_spacemouse(CENTER, reach=REACH)
    assert 'ATTRS{idVendor}=="046d", TAG+="uaccess"' in caught.value.advice
    assert "/etc/udev/rules.d/70-" in caught.value.advice  # before 73-seat-late.rules
