"""The SpaceMouse driver on the real hidapi and a device that umockdev mocks; no root is needed."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import pytest

from tests.client.devices.mocked import run_mocked

pytestmark = pytest.mark.live

SCRIPT = Path(__file__).with_name("umock_spacemouse.py")
FULL_SPEED = 0.15  # m/s
REACH = 0.1  # m
TOLERANCE = 1e-9  # m or m/s; rounding only


@pytest.mark.skipif(sys.platform != "linux", reason="umockdev mocks devices of Linux only")
def test_a_mocked_device_is_found_opened_read_and_unplugged(tmp_path: Path) -> None:
    seen = run_mocked(SCRIPT, str(tmp_path))

    assert "no SpaceMouse was found" in seen["before"]
    assert_sample(seen["rest"], [0.0, -REACH, 0.0], [0.0, 0.0, 0.0])
    velocity = [FULL_SPEED, FULL_SPEED, FULL_SPEED]  # right, away from the user, up
    assert_sample(seen["moved"], [0.0, -REACH, 0.0], velocity)
    way = 0.01 * FULL_SPEED  # in 10 ms without a report
    assert_sample(seen["held"], [way, way - REACH, way], velocity)
    # Without one for 0.2 s: it stands, after at most one period more than that.
    (x, *_), velocity, fresh = seen["gone"]
    assert 0.2 * FULL_SPEED - TOLERANCE <= x <= 0.22 * FULL_SPEED
    assert (velocity, fresh) == ([0.0, 0.0, 0.0], False)
    assert seen["stopped"] == [seen["gone"][0], [0.0, 0.0, 0.0], True]
    assert [each.split(" at ")[0] for each in seen["unknown"]] == ["1209:abcd Six Axes"]
    assert "unplugged" in seen["unplugged"]
    assert "no SpaceMouse was found" in seen["after"]


def assert_sample(seen: list[Any], position: list[float], velocity: list[float]) -> None:
    assert seen[0] == pytest.approx(position, abs=TOLERANCE)
    assert seen[1] == pytest.approx(velocity, abs=TOLERANCE)
