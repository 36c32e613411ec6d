from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic_client.devices.spacemouse import (
    DEAD_BAND,
    Motion,
    decode,
    without_dead_band,
)
from tests.client.devices.spacemouse_cases import (
    any_report,
    counts,
    fractions,
    report,
)


@given(st.one_of(any_report, st.lists(st.integers(), max_size=20)))
def test_no_report_is_an_error(data: list[int]) -> None:
    event = decode(data)
    if isinstance(event, Motion):
        parts = [part for part in (event.translation, event.rotation) if part is not None]
        assert parts
        assert all(-1.0 <= value <= 1.0 for part in parts for value in part)
    else:
        assert event is None or event.pressed >= 0


@given(counts, counts)
def test_devices_with_two_reports_and_with_a_long_one_mean_the_same(
    translation: tuple[int, int, int], rotation: tuple[int, int, int]
) -> None:
    long = decode(report(1, *translation, *rotation))
    first, second = decode(report(1, *translation)), decode(report(2, *rotation))
    assert isinstance(long, Motion)
    assert first == Motion(long.translation, None)
    assert second == Motion(None, long.rotation)


@pytest.mark.parametrize("kind", [1, 2])
@pytest.mark.parametrize("length", range(7))
def test_a_truncated_motion_is_ignored(kind: int, length: int) -> None:
    assert decode(report(kind, 350, 350, 350)[:length]) is None


@pytest.mark.parametrize("length", range(7, 13))
def test_of_a_truncated_long_motion_the_whole_half_counts(length: int) -> None:
    assert decode(report(1, 350, 0, 0, 350, 350, 350)[:length]) == Motion((1.0, 0.0, 0.0), None)


def test_axes_are_those_of_the_world() -> None:
    right, toward_user, down = report(1, 350, 0, 0), report(1, 0, 350, 0), report(1, 0, 0, 350)
    assert decode(right) == Motion((1.0, 0.0, 0.0), None)
    assert decode(toward_user) == Motion((0.0, -1.0, 0.0), None)
    assert decode(down) == Motion((0.0, 0.0, -1.0), None)
    assert decode(report(2, 70, 70, 70)) == Motion(None, (0.2, -0.2, -0.2))


@given(fractions, fractions)
def test_the_dead_band_is_odd_rising_and_without_a_jump(a: float, b: float) -> None:
    (fa, fb, fz), (ga, _, _) = without_dead_band((a, b, 0.0)), without_dead_band((-a, b, 0.0))
    assert fz == 0.0
    assert ga == -fa
    assert (fa - fb) * (a - b) >= 0.0
    assert abs(fa - fb) <= abs(a - b) / (1.0 - DEAD_BAND) + 1e-15
    assert fa == 0.0 or abs(a) > DEAD_BAND
