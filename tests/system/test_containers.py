"""The image and docker-compose.yml, with podman and Debian's packages: see tools/containers.py."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from container_store import missing
from containers import ROOT
from tests.give_up import give_up

pytestmark = [pytest.mark.alone, pytest.mark.night, pytest.mark.timeout(3600)]


def test_the_containers_come_up_touch_and_go(tmp_path: Path) -> None:
    if sys.platform != "linux" or os.geteuid() != 0:
        pytest.skip("debootstrap makes files of the superuser's")
    if packages := missing():
        give_up(f"containers: {', '.join(packages)} is not installed")
    place = Path(os.environ.get("TMPDIR", "/var/tmp"))
    before = set(place.glob("cohaptic-containers-*"))
    pip = [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps"]
    subprocess.run([*pip, "--wheel-dir", str(tmp_path), "."], cwd=ROOT, check=True)
    command = [sys.executable, "tools/containers.py", "--wheels", str(tmp_path)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stdout.splitlines()[-1].startswith("held: image built, page through TLS")
    assert set(place.glob("cohaptic-containers-*")) <= before
