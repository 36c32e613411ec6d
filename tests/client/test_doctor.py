from __future__ import annotations

import pytest
import typer
from typer.testing import CliRunner

from cohaptic_client.doctor import (
    MAX_LATE,
    Finding,
    doctor,
    of_clock,
    of_measurement,
    of_nodes,
)

pytestmark = pytest.mark.live
GOOD = {
    "scheduling": "real-time (SCHED_FIFO 5)",
    "memory": "memory locked",
    "compiled": "compiled",
    "periods": 5000,
    "late_p50": 5e-5,
    "late_p99": 2e-4,
    "late_most": 4e-4,
    "late_by_a_period": 0.0,
}


def advised(found: list[Finding]) -> set[str]:
    return {finding.subject for finding in found if finding.advice}


@pytest.mark.parametrize(
    ("key", "value", "subject"),
    [
        ("scheduling", "nice -10", "scheduling"),
        ("scheduling", "normal", "scheduling"),
        ("compiled", "plain Python: no compiled modules", "loop"),
        ("late_by_a_period", 1.01 * MAX_LATE, "lateness"),
    ],
)
def test_what_it_lacks_is_named_with_what_to_do(key: str, value: object, subject: str) -> None:
    assert advised(of_measurement(GOOD | {key: value})) == {subject}


def test_a_slow_clock_and_a_closed_node_are_named() -> None:
    assert of_clock("hpet", 1e-9).advice
    assert not of_clock("tsc", 1e-9).advice
    assert not of_clock("", 1e-9).advice
    assert not of_nodes([]).advice
    assert not of_nodes([("/dev/hidraw0", True)]).advice
    closed = of_nodes([("/dev/hidraw0", True), ("/dev/ttyACM0", False)])
    assert closed.advice
    assert "/dev/ttyACM0" in closed.found
    assert "/dev/hidraw0" not in closed.found


def test_the_command_says_a_line_for_each_and_its_status_says_whether_all_is_well() -> None:
    app = typer.Typer()
    app.command()(doctor)
    done = CliRunner().invoke(app, ["--seconds", "0.2"])
    lines = done.output.splitlines()
    for subject in ("versions", "scheduling", "memory", "loop", "lateness", "clock"):
        assert any(f" {subject}: " in line for line in lines), done.output
    assert done.exit_code == int(any(line.startswith("warning") for line in lines))
