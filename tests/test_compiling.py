"""One build at a time, with tools that are fetched where the environment lacks them."""

from __future__ import annotations

import sys
import threading
from pathlib import Path

import pytest

from compiling.alone import alone
from tests.client.devices.until import until


@pytest.mark.skipif(sys.platform == "win32", reason="there is no such lock")
def test_a_second_build_waits_until_the_first_has_ended(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    order: list[str] = []

    def build_too() -> None:
        with alone(tmp_path):
            order.append("second")

    second = threading.Thread(target=build_too)
    with alone(tmp_path):
        second.start()
        until(lambda: "waiting for another process" in capsys.readouterr().out)
        with alone(tmp_path / "another"):
            order.append("first")
    second.join()
    assert order == ["first", "second"]
