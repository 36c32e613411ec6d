"""Before its first start the demo has compiled the kernels that its ticks call."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from compiling.sources import units

pytestmark = pytest.mark.live

ROOT = Path(__file__).parents[2]
# A kernel in plain Python, so that its calls can be seen, in a process of its own.
CALLED = """
import sys
from cohaptic.simulated.delay_line import LinkSettings
from cohaptic_experiments.virtual_session import VirtualSession
from cohaptic_server.bodies.balloon.balloon import Balloon
from cohaptic_tools.demo.scene import Scene

called = set()
near = LinkSettings()
for scene in (Scene(link=near), Scene(4, near), Scene(link=near, friction=0.8)):
    session = VirtualSession(Balloon())
    for user, name in enumerate(scene.names):
        session.join(name, scene.script(user), friction=scene.friction)
    session.run(1.5)  # they press, and what is done once is done
    see = lambda frame, event, of: event == "call" and called.add(frame.f_code.co_filename)
    sys.setprofile(see)
    session.run(0.2)
    sys.setprofile(None)
print(*called, sep="\\n")
"""


def test_what_a_tick_of_the_demo_calls_is_compiled_before_its_first_start() -> None:
    sides = ("shared", "server", "client", "experiments")
    done = subprocess.run(
        [sys.executable, "-c", CALLED],
        env={
            **os.environ,
            "COHAPTIC_PLAIN": "1",
            "PYTHONPATH": os.pathsep.join(str(ROOT / side) for side in sides),
        },
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    files = {Path(line).as_posix() for line in done.stdout.splitlines()}
    kernels = {
        module: unit.first
        for unit in units(ROOT)
        if unit.group == "kernels"
        for module in unit.modules
    }
    called = {
        module
        for module in kernels
        if any(file.endswith(f"/{module.replace('.', '/')}.py") for file in files)
    }
    assert called
    assert {module for module in called if not kernels[module]} == set()
