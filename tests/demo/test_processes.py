"""Only what is cheap; `tests/system` plays whole scenes."""

from __future__ import annotations

from pathlib import Path

import pytest

from cohaptic_tools.demo.processes import DemoFailed, Process, Stage
from cohaptic_tools.demo.scene import Scene

pytestmark = pytest.mark.alone


def test_a_process_that_does_not_start_is_quoted(tmp_path: Path) -> None:
    """Its last line is its own, although its lifeline is still open when it ends."""
    process = Process("serve", "--port", "0", "--body", "liver", log=tmp_path / "log")
    try:
        with pytest.raises(DemoFailed, match=r"did not start: cohaptic: body is 'liver'; it must"):
            process.first_line()
    finally:
        process.wait()
    assert not process.running
    assert process.line == ""


def test_a_stage_without_a_server_says_why_and_leaves_nothing_behind(tmp_path: Path) -> None:
    stage, why = Stage(Scene(simulation_hz=5.0), tmp_path), "simulation rate is 5.0 Hz; it must be"
    with pytest.raises(DemoFailed, match=f"did not start: cohaptic: {why}"):
        stage.__enter__()
    assert not stage.server.running
    assert stage.users == {}
    # What is gone is shown with its last words.
    stage.users["left"] = stage.server
    (status,) = stage.statuses()
    assert status.name == "left"
    assert status.state.startswith(f"gone: cohaptic: {why}")
