from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic.errors import DeviceError
from cohaptic_drivers.dualsense.reports import SIDES, Effects, Side, decode, encode
from tests.drivers.dualsense.pad_reports import pad_report, understood

RIGHT, LEFT = SIDES["right"], SIDES["left"]
sides = st.sampled_from([RIGHT, LEFT])
byte = st.integers(0, 255)
numbers = st.one_of(
    st.binary(max_size=80).map(list),
    st.binary(min_size=63, max_size=63).map(lambda rest: [1, *rest]),
    st.binary(max_size=80).map(lambda rest: [0x31, *rest]),
    st.lists(st.integers(-300, 300), max_size=70),
)


@given(numbers, sides)
def test_any_report_is_refused_or_tells_what_can_be(report: list[int], side: Side) -> None:
    if report and report[0] == 0x31 and all(0 <= number <= 255 for number in report):
        with pytest.raises(DeviceError, match="connected by Bluetooth; connect it by cable"):
            decode(report, side)
        return
    held = decode(report, side)
    whole = len(report) == 64 and report[0] == 1 and 0 <= min(report) <= max(report) <= 255
    assert (held is not None) == whole
    if held is not None:
        assert all(-1.0 <= fraction <= 1.0 for fraction in (*held.left, *held.right))
        assert 0 <= held.pull <= 255
        assert 0 <= held.buttons < 1 << 15


def test_a_report_is_read_as_its_layout_says() -> None:
    report = pad_report(
        left=(255, 0), right=(0, 255), l2=20, r2=200, buttons=(0b0010_1000, 0b1000_0001, 0b111)
    )
    held = decode(report, RIGHT)
    assert held is not None
    assert held.left == pytest.approx((1.0, 1.0), abs=0.01)
    assert held.right == pytest.approx((-1.0, -1.0), abs=0.01)
    assert held.pull == 200
    # cross; L1 and R3; PS, touchpad and mute
    assert held.buttons == 0b111_1000_0001_0010
    other = decode(report, LEFT)
    assert other is not None
    assert other.pull == 20


@given(byte, byte, byte, sides)
def test_the_pad_understands_what_it_is_told(
    start: int, resistance: int, rumble: int, side: Side
) -> None:
    reported = Effects(start if resistance else 0, resistance, rumble)
    assert understood(encode(reported, side), side.block) == reported
