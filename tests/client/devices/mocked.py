"""Runs a script under umockdev, for the tests of HID drivers; no root is needed."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

from tests.client.devices.umock import UNAVAILABLE
from tests.give_up import give_up
from tests.patience import PATIENCE

ROOT = Path(__file__).parents[3]


def run_mocked(script: Path, *arguments: str) -> Any:
    """What a script prints as JSON; the test is given up where umockdev cannot be used."""
    wrapper = shutil.which("umockdev-wrapper")
    if wrapper is None:
        give_up("umockdev is not installed; on Debian: umockdev gir1.2-umockdev-1.0 python3-gi")
    path = os.pathsep.join([str(ROOT), *sys.path])
    run = subprocess.run(
        [wrapper, sys.executable, str(script), *arguments],
        capture_output=True,
        text=True,
        timeout=PATIENCE,
        check=False,
        env={**os.environ, "PYTHONPATH": path},
    )
    if run.returncode == UNAVAILABLE:
        give_up(run.stdout.strip())
    assert run.returncode == 0, run.stderr
    return json.loads(run.stdout)
