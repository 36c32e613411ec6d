"""An account that the system does not know, and that has no home folder: one of a container."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from cohaptic_server.mesh.icosphere import icosphere
from tests.give_up import give_up
from tests.patience import PATIENCE
from tests.server.objects.files import write

pytestmark = pytest.mark.live

STRANGER = ["unshare", "--user", "--map-user=54321"]  # an account in a namespace of its own
HELD = ["--edge", "0.25", "--fix", "z < 10%"]
NO_HOME = "this account has no home folder with a whole path; COHAPTIC_CACHE names another folder"


@pytest.fixture
def stranger(tmp_path: Path) -> list[str]:
    """How a command starts as that account; skips where there can be none."""
    if sys.platform != "linux" or shutil.which("unshare") is None:
        give_up("accounts of a namespace need Linux and util-linux")
    if subprocess.run([*STRANGER, "true"], capture_output=True, check=False).returncode:
        give_up("this machine allows no namespace with an account of its own")
    x, faces = icosphere(2, 0.05)
    write(tmp_path / "ball.stl", x, faces)
    return [*STRANGER, sys.executable, "-m", "cohaptic"]


@pytest.fixture
def environment() -> dict[str, str]:
    none = {"HOME", "XDG_CACHE_HOME", "COHAPTIC_CACHE"}
    return {name: value for name, value in os.environ.items() if name not in none}


def test_it_is_served_without_a_cache_and_told_so_once(
    stranger: list[str], environment: dict[str, str], tmp_path: Path
) -> None:
    with subprocess.Popen(
        [*stranger, "serve", "--body", "ball.stl", "--port", "0", *HELD, "--lifeline"],
        cwd=tmp_path,
        env=environment,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as server:
        assert server.stdout is not None
        assert server.stdout.readline().startswith("listening ws://")
        _, said = server.communicate(timeout=PATIENCE)  # it ends with its input
    assert server.returncode == 0, said
    assert said.count("nothing is stored, the next start takes as long: " + NO_HOME) == 1
    assert "Traceback" not in said
    assert [path.name for path in tmp_path.iterdir()] == ["ball.stl"]
