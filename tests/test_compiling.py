"""One build at a time, with tools that are fetched where the environment lacks them."""

from __future__ import annotations

import importlib.util
import os
import sys
import threading
import zipfile
from pathlib import Path

import pytest

from compiling import tools
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


def a_wheel(folder: Path, name: str) -> None:
    info = f"{name}-1.dist-info"
    with zipfile.ZipFile(folder / f"{name}-1-py3-none-any.whl", "w") as wheel:
        wheel.writestr(f"{name}.py", "")
        wheel.writestr(f"{info}/METADATA", f"Metadata-Version: 2.1\nName: {name}\nVersion: 1\n")
        wheel.writestr(f"{info}/WHEEL", "Wheel-Version: 1.0\nTag: py3-none-any\n")
        wheel.writestr(f"{info}/RECORD", "")


@pytest.mark.live
def test_missing_tools_are_there_within_the_block_only(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    name = "cohaptic_tool_of_a_test"
    monkeypatch.setattr(tools, "_MODULES", (name,))
    monkeypatch.setattr(tools, "TOOLS", [name])
    monkeypatch.setenv("PIP_NO_INDEX", "1")
    monkeypatch.setenv("PIP_FIND_LINKS", str(tmp_path))
    before = (list(sys.path), os.environ.get("PYTHONPATH"))
    with pytest.raises(tools.ToolsError, match="pip could not fetch"), tools.tools():
        pass
    a_wheel(tmp_path, name)
    with tools.tools():
        assert tools.are_here()
        spec = importlib.util.find_spec(name)
        assert spec is not None
        assert spec.origin is not None
        assert Path(spec.origin).parent == Path(os.environ["PYTHONPATH"].split(os.pathsep)[0])
    assert not Path(spec.origin).exists()
    assert not tools.are_here()
    assert (sys.path, os.environ.get("PYTHONPATH")) == before
