"""A checkout with two kernels and a loop of two modules, to be compiled by the real build."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

from compiling.build import build
from compiling.compiler import missing
from tests.give_up import give_up

ROOT = Path(__file__).parents[1]
FILES = {
    "pyproject.toml": """
[tool.cohaptic.compile]
first = ["cohaptic_server.mean"]
loop = ["cohaptic.vec", "cohaptic_client.tip"]
""",
    "server/cohaptic_server/__init__.py": "",
    "server/cohaptic_server/total.py": """
def total(values):
    found = 0.0
    for i in range(values.shape[0]):
        found += values[i]
    return found
""",
    "server/cohaptic_server/total.pxd": """
cimport cython
@cython.locals(i=Py_ssize_t, found=double)
cpdef double total(const double[::1] values) noexcept
""",
    "server/cohaptic_server/mean.py": """
from cohaptic_server.total import total
def mean(values):
    return total(values) / values.shape[0]
""",
    "server/cohaptic_server/mean.pxd": """
from cohaptic_server.total cimport (
    total,
)
cpdef double mean(const double[::1] values) noexcept
""",
    "client/cohaptic_client/__init__.py": "",
    "client/cohaptic_client/tip.py": """
from cohaptic.vec import Vec3, norm
def reach(tip: Vec3) -> float:
    return norm(tip)
""",
}
USES = """
import json, sys
import cohaptic.compiled as compiled
used = [compiled.use("kernels"), compiled.use("loop")]
import numpy
import cohaptic.vec
from cohaptic_client import tip
from cohaptic_server import mean, total
values = [mean.mean(numpy.array([1.0, 2.0, 6.0])), tip.reach((3.0, 4.0, 0.0))]
print(json.dumps({
    "used": used, "values": values, "kernels": compiled.describe("kernels"),
    "loop": compiled.describe("loop"),
    "why_plain": [compiled.why_plain("kernels"), compiled.why_plain("loop")],
    "plain": [m.__name__ for m in (mean, total, tip, cohaptic.vec) if m.__file__.endswith(".py")],
}))
"""


def make_checkout(root: Path) -> Path:
    """Write it and compile everything; without a compiler the test is skipped."""
    why = missing()
    if why:
        give_up(why)
    ignored = shutil.ignore_patterns("__pycache__", "_compiled")
    shutil.copytree(ROOT / "shared/cohaptic", root / "shared/cohaptic", ignore=ignored)
    for name, text in FILES.items():
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        (root / name).write_text(text)
    assert build(root) == 5  # two kernels and that of shared, what they share, and the loop
    return root


def used_in(root: Path, before: str = "", **environment: str) -> dict[str, Any]:
    """What a new process uses of a checkout, and what the modules answer."""
    path = os.pathsep.join(str(root / side) for side in ("shared", "server", "client"))
    done = subprocess.run(
        [sys.executable, "-c", before + USES],
        env={**os.environ, "PYTHONPATH": path, **environment},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    found: dict[str, Any] = json.loads(done.stdout)
    # Compiled or not, the answers are the same.
    assert found["values"] == [3.0, 5.0]
    return found
