"""What a preparation was said to take, beside what the system counts; and its interruption."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cohaptic_server.mesh.icosphere import icosphere
from cohaptic_server.testing.blocks import block
from tests.patience import PATIENCE
from tests.server.objects.files import write

pytest.importorskip("pytetwild", reason="pip install 'cohaptic[objects]' fills surfaces")
meshio: Any = pytest.importorskip("meshio", reason="pip install 'cohaptic[objects]' reads volumes")
pytestmark = [
    pytest.mark.live,
    pytest.mark.skipif(sys.platform == "win32", reason="it says no peak of memory"),
]

SAID = re.compile(r"([\d.]+) GB of memory at the most \(([\d.]+) expected\)")


def started(file: Path, *options: str, store: Path) -> subprocess.Popen[str]:
    path = os.pathsep.join(entry for entry in sys.path if entry)
    return subprocess.Popen(
        [sys.executable, "-m", "cohaptic", "body", "prepare", str(file), *options],
        env=os.environ | {"COHAPTIC_CACHE": str(store), "PYTHONPATH": path, "COLUMNS": "200"},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def ball(folder: Path) -> tuple[Path, list[str]]:
    """Small, yet there is half a second of work after each result, for the signal to come into."""
    options = ["--fix", "z < 10%", "--edge", "0.1"]
    return write(folder / "ball.stl", *icosphere(2, 0.05)), options


def surface(name: str, by: tuple[float, float, float], folder: Path) -> Path:
    x, faces = icosphere(3, 0.05)
    return write(folder / name, x * np.array(by), faces)


def volume(size: tuple[float, float, float], cells: tuple[int, int, int], folder: Path) -> Path:
    mesh, path = block(size, cells), folder / "block.vtu"
    meshio.Mesh(mesh.vertices, [("tetra", mesh.tets)]).write(path)
    return path


SHAPES: dict[str, tuple[Callable[[Path], Path], list[str]]] = {
    "ball": (lambda folder: surface("ball.stl", (1, 1, 1), folder), ["--fix", "z < 10%"]),
    "coarse ball": (
        lambda folder: surface("ball.stl", (1, 1, 1), folder),
        ["--fix", "z < 10%", "--edge", "0.1"],
    ),
    "rod": (lambda folder: surface("rod.ply", (0.15, 0.15, 2), folder), ["--fix", "z < 10%"]),
    "plate": (lambda folder: surface("plate.obj", (1.5, 1.5, 0.1), folder), ["--fix", "x < 10%"]),
    "cube": (lambda folder: volume((0.1, 0.1, 0.1), (11, 11, 11), folder), ["--fix", "z <= 0%"]),
    "linear": (
        lambda folder: volume((0.1, 0.1, 0.1), (20, 20, 20), folder),
        ["--fix", "z <= 0%", "--order", "1"],
    ),
    "beam": (lambda folder: volume((0.05, 0.05, 0.4), (5, 5, 40), folder), ["--fix", "z <= 0%"]),
}


# A surface that is filled, and a volume of either order; the others take half a minute.
SHORT = ("coarse ball", "cube", "linear")


@pytest.mark.parametrize(
    "name",
    [name if name in SHORT else pytest.param(name, marks=pytest.mark.night) for name in SHAPES],
)
def test_no_more_memory_is_taken_than_was_said_before(name: str, tmp_path: Path) -> None:
    make, options = SHAPES[name]
    process = started(make(tmp_path), *options, store=tmp_path / "store")
    out, err = process.communicate(timeout=5 * PATIENCE)
    assert process.returncode == 0, err
    found = SAID.search(out)
    assert found, out
    taken, expected = float(found[1]), float(found[2])
    print(f"{name}: {taken:.2f} GB of {expected:.2f}")
    assert 0.5 * expected <= taken <= expected


def entries(store: Path) -> list[str]:
    return sorted(path.name for path in store.glob("*.arrays")) if store.is_dir() else []
