from __future__ import annotations

from dataclasses import replace
from threading import Event

import pytest
import typer
from typer.testing import CliRunner

from cohaptic.errors import DeviceError, SettingError
from cohaptic_client.devices import hid_devices
from cohaptic_client.devices.catalogue import open_device, read_device
from cohaptic_client.devices.hid_devices import Entry
from cohaptic_client.doctor import doctor
from cohaptic_drivers.dualsense import dualsense_kind
from cohaptic_drivers.dualsense.dualsense_kind import find_pads
from tests.client.plane import CONFIG
from tests.drivers.dualsense.pad_reports import pad_report


class FakePad:
    """A pad whose left trigger is pulled by 100 and whose right one by 155.

    Its reports come as a real one's do, with time between them: the thread that reads them has a
    high priority and would else keep a core from the thread that opened the pad.
    """

    def __init__(self, allowed: bool) -> None:
        self._allowed, self._waiting, self._closed = allowed, False, Event()

    def open_path(self, path: bytes, /) -> None:
        if not self._allowed:
            raise OSError("open failed")

    def set_nonblocking(self, on: int, /) -> None:
        pass

    def read(self, max_length: int, timeout_ms: int = 0, /) -> list[int]:
        self._closed.wait(timeout_ms / 1000)
        self._waiting = not self._waiting
        return list(pad_report(l2=100, r2=155)) if self._waiting else []

    def write(self, report: bytes, /) -> int:
        return len(report)

    def close(self) -> None:
        self._closed.set()


class FakeHidapi:
    def __init__(self, entries: list[Entry], allowed: bool = True) -> None:
        self.entries, self.allowed = entries, allowed

    def enumerate(self, vendor_id: int = 0, product_id: int = 0, /) -> list[Entry]:
        return [
            e for e in self.entries if (e["vendor_id"], e["product_id"]) == (vendor_id, product_id)
        ]

    def device(self) -> FakePad:
        return FakePad(self.allowed)


def entry(number: int, serial: str, bus: int = 1, product: int = 0x0CE6) -> Entry:
    return Entry(
        path=f"/dev/hidraw{number}".encode(), vendor_id=0x054C, product_id=product,
        product_string="DualSense", serial_number=serial, usage_page=1, usage=5,
        interface_number=3, bus_type=bus,
    )  # fmt: skip


def here(monkeypatch: pytest.MonkeyPatch, entries: list[Entry], *, allowed: bool = True) -> None:
    monkeypatch.setattr(dualsense_kind, "FIRST_REPORT", 20.0)  # however busy the machine is
    fake = FakeHidapi(entries, allowed)

    def hidapi(name: str) -> FakeHidapi:
        return fake

    monkeypatch.setattr(dualsense_kind, "hidapi", hidapi)
    monkeypatch.setattr(hid_devices, "hidapi", hidapi)


def test_pads_are_found_by_serial_or_where_that_says_nothing_by_number(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    here(
        monkeypatch, [entry(0, "a:b"), entry(1, ""), entry(2, "c"), entry(3, "c"), entry(4, "x,y")]
    )
    assert [each.choice.partition(":")[2] for each in find_pads()] == [
        "serial=a:b", "number=2", "number=3", "number=4", "number=5",
    ]  # fmt: skip
    assert all(not each.problem for each in find_pads())


@pytest.mark.live
def test_one_that_may_not_be_opened_is_told_with_the_rule_that_helps(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    here(monkeypatch, [entry(0, "a")], allowed=False)
    app = typer.Typer()
    app.command()(doctor)
    result = CliRunner().invoke(app, ["--seconds", "0"])
    assert result.exit_code == 1, result.output
    assert "dualsense:serial=a (DualSense at /dev/hidraw0): it could not be opened" in result.output
    assert 'KERNEL=="hidraw*", ATTRS{idVendor}=="054c", TAG+="uaccess"' in result.output
    with pytest.raises(DeviceError, match="was found but could not be opened"):
        open_device(replace(CONFIG.device, choice=read_device("dualsense")))


@pytest.mark.parametrize(
    ("options", "start", "inward"),
    [
        ("right", (1.0, 2.0 - 0.55, 3.0), (0.0, 1.0, 0.0)),
        ("left,place=top", (1.0, 2.0, 3.55), (0.0, 0.0, -1.0)),
        ("turn=90", (1.55, 2.0, 3.0), (-1.0, 0.0, 0.0)),
    ],
)
def test_the_tip_starts_off_the_body_and_the_trigger_goes_toward_it(
    options: str,
    start: tuple[float, ...],
    inward: tuple[float, ...],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    here(monkeypatch, [entry(0, "a")])
    choice = read_device(f"dualsense:{options}")
    device = open_device(replace(CONFIG.device, choice=choice, center=(1.0, 2.0, 3.0), radius=0.5))
    assert device.read(0.0).position == pytest.approx(start)
    velocity = device.read(0.001).velocity
    device.close()
    speed = max(map(abs, velocity))
    assert speed > 0.1
    assert [v / speed for v in velocity] == pytest.approx(inward)


@pytest.mark.parametrize(
    "options",
    ["trigger=middle", "depth=1", "depth=201", "full=0.4", "full=11", "number=0", "number=17",
     "place=center", "turn=361", "scale=2"],
)  # fmt: skip
def test_options_outside_their_limits_are_refused(options: str) -> None:
    with pytest.raises(SettingError):
        read_device(f"dualsense:{options}")
