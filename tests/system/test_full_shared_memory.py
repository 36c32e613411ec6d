"""A server whose /dev/shm is too small for the memory that its column process shares with it."""

from __future__ import annotations

import json
import subprocess
import sys
import threading
from pathlib import Path
from typing import Any

import pytest

from cohaptic_server.testing.blocks import block
from cohaptic_tools.demo.processes import Process
from tests.give_up import give_up

pytestmark = pytest.mark.live
meshio: Any = pytest.importorskip("meshio", reason="pip install 'cohaptic[objects]' reads volumes")

SMALL = "4k"
# In a namespace of its own, so that nobody else's /dev/shm is small.
WITH_A_SMALL_ONE = f'mount -t tmpfs -o size={SMALL} cohaptic-test /dev/shm && exec "$@"'


def test_a_solid_is_touched_all_the_same(tmp_path: Path) -> None:
    """What does not fit lies in the folder for temporary files, and no write ends the server."""
    within = ["unshare", "--mount", "sh", "-c", WITH_A_SMALL_ONE, "sh"]
    if sys.platform != "linux":
        give_up("/dev/shm needs Linux")
    tried = subprocess.run([*within, "true"], capture_output=True, text=True, check=False)
    if tried.returncode:
        give_up(f"no /dev/shm can be mounted here: {tried.stderr.strip()}")
    mesh, path = block((0.1, 0.1, 0.1), (8, 8, 8)), tmp_path / "block.vtu"
    meshio.Mesh(mesh.vertices, [("tetra", mesh.tets)]).write(path)
    command = [sys.executable, "-m", "cohaptic", "serve", "--port", "0", "--body", str(path)]
    with subprocess.Popen(
        [*within, *command, "--fix", "z <= 0%"], stdout=subprocess.PIPE, text=True
    ) as server:
        assert server.stdout is not None
        try:
            url = server.stdout.readline().strip().removeprefix("listening ")
            hand = Process("touch", url, "--name", "ann", "--json-lines", log=tmp_path / "ann.log")
            try:
                reported = json.loads(hand.first_line())
                while reported["state"] != "touching" or reported["force"] < 0.1:
                    assert hand.running, (tmp_path / "ann.log").read_text()
                    threading.Event().wait(0.05)
                    reported = json.loads(hand.line or "{}") or reported
            finally:
                hand.wait()
            assert server.poll() is None
            maps = Path(f"/proc/{server.pid}/maps").read_text().splitlines()
            shared = [line for line in maps if "/pym-" in line]  # of `multiprocessing`
            assert shared
            assert not any("/dev/shm" in line for line in shared)
        finally:
            server.terminate()
