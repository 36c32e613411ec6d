"""A thousand connections that never shake hands, by `benchmarks/idle_connections.py`."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.alone
ROOT = Path(__file__).parents[2]
SECONDS = 3.0
# Bytes for each: 0.3 kB in the server where ten thousand are held; of a thousand its breath shows.
LARGEST, MAX_OF_KERNEL = 6 * 1024, 32 * 1024


@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
def test_a_thousand_connections_that_say_nothing_cost_little_and_a_user_goes_on(
    tmp_path: Path,
) -> None:
    report = tmp_path / "report.json"
    command = [
        sys.executable, "benchmarks/idle_connections.py", "--connections", "1000",
        "--addresses", "20", "--seconds", str(SECONDS), "--limits", "usual", "--json", str(report),
    ]  # fmt: skip
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    (row,) = json.loads(report.read_text())["results"]
    assert row["most_held"] >= 900
    assert row["server_bytes_each"] < LARGEST
    assert row["kernel_bytes_each"] < MAX_OF_KERNEL
    assert row["log_lines"] < 1000  # of which each address has a budget
    # No bound of time, which is other tests' business; but the room goes on.
    assert row["left_out"] < 0.5 * SECONDS * 60.0
