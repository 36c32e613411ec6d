"""The command `cohaptic bench transparency`, as on the command line."""

from __future__ import annotations

import json
import math
from pathlib import Path

import pytest

import cohaptic.cli.app

PNG = b"\x89PNG"


def bench(*arguments: str) -> None:
    cohaptic.cli.app.main(["bench", "transparency", *arguments])


@pytest.mark.night
def test_a_measurement_is_shown_written_and_drawn(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Bounds of the program as it is, which may only get better."""
    reported, drawn = tmp_path / "found.json", tmp_path / "found.png"
    with pytest.raises(SystemExit) as ended:
        bench("--delay-ms", "0", "--delay-ms", "80", "--json", str(reported), "--out", str(drawn))
    assert ended.value.code == 0
    assert drawn.read_bytes().startswith(PNG)
    near, far = json.loads(reported.read_text())["rows"]
    assert (near["law"], near["users"], near["delay_ms"], far["delay_ms"]) == (
        "predictive", 2, 0.0, 80.0,
    )  # fmt: skip
    # A bandwidth that ends nowhere is null in JSON.
    assert (near["bandwidth_hz"] or math.inf) > 15.0
    assert (far["bandwidth_hz"] or math.inf) > 15.0
    assert max(near["largest"], far["largest"]) < 1.2
    for row, ways, limit in ((near, 0.0, 55.0), (far, 160.0, 220.0)):
        (press,) = row["press"]
        assert ways < press["onset_ms"] < press["half_ms"] < press["most_ms"] < limit
        assert press["change_n"] == pytest.approx(press["true_change_n"], rel=0.01)
        assert len(row["others"]) == len(row["own"]) == len(row["frequencies_hz"])
        assert row["budget_ms"] is None
    said = capsys.readouterr().out
    assert "80 ms, 2 hands" in said
    assert max(map(len, said.splitlines())) <= 80
