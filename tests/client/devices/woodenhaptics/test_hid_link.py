"""The driver on the older boards, through the real hidapi and devices that umockdev mocks."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from tests.client.devices.mocked import run_mocked

pytestmark = pytest.mark.patient

SCRIPT = Path(__file__).with_name("umock_wooden.py")
SIZES = {"h1": 8, "h2": 14, "h3": 64}


@pytest.mark.skipif(sys.platform != "linux", reason="umockdev mocks devices of Linux only")
@pytest.mark.parametrize("generation", SIZES)
def test_a_mocked_board_is_found_pressed_moved_stalled_and_unplugged(
    generation: str, tmp_path: Path
) -> None:
    seen = run_mocked(SCRIPT, str(tmp_path), generation)
    assert "no board was found" in seen["before"]
    assert "differ in the directions of their motors; try it with force=off" in seen["unconfirmed"]
    size = SIZES[generation]
    assert f"sends reports of {size} bytes, not of" in seen["other"]
    assert seen["home"] == pytest.approx([0.0, -0.025, 0.205])
    # of the vectors in test_kinematics.py
    assert seen["pressed"] == pytest.approx([1182.4, -659.6, -2364.9], abs=0.6)
    assert seen["moved"][0] > 0.0
    assert seen["idle"]
    assert seen["second_rests"]
    assert "its board has been silent" in seen["stalled"]
    assert seen["after_close"] == [0, 0, 0]
    assert "it was unplugged" in seen["unplugged"]
