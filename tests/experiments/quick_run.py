"""An experiment in its quick form, as on the command line."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import pytest

import cohaptic
import cohaptic.cli.app

PNG = b"\x89PNG"


def check_quick_run(name: str, tmp_path: Path) -> None:
    """Run an experiment, and check that its verdict holds and that its files are whole."""
    with pytest.raises(SystemExit) as ended:
        cohaptic.cli.app.main(
            ["experiment", name, "--out", str(tmp_path), "--quick", "--seed", "3"]
        )
    assert ended.value.code == 0
    folder = tmp_path / name
    assert (folder / "figure.png").read_bytes().startswith(PNG)
    rows = list(csv.reader((folder / "data.csv").read_text().splitlines()))
    assert len(rows) > 3
    assert {len(row) for row in rows} == {len(rows[0])}
    said = json.loads((folder / "summary.json").read_text())
    assert said["name"] == name
    assert said["verdict"] == "holds"
    assert said["seed"] == 3
    assert said["version"] == cohaptic.__version__
    assert f"experiment {name}" in said["command"]
    assert len(said["checks"]) >= 2
    for check in said["checks"]:
        assert check["passed"]
        assert check["at_least"] is not None or check["at_most"] is not None
    assert said["numbers"]
