"""The body of step 4 of the course keeps the laws of a body, and people feel each other in it."""

from __future__ import annotations

import importlib.util
import json
import math
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from cohaptic import HandScript, Rhythm
from cohaptic_experiments import VirtualSession
from cohaptic_server import Body, Load

pytestmark = pytest.mark.live

EXAMPLE = Path(__file__).parents[2] / "examples/step_4_own_body.py"
FOUNDATION = 4e3  # N/m^3, the default of the example


@pytest.fixture(scope="module")
def example() -> ModuleType:
    spec = importlib.util.spec_from_file_location("step_4_own_body", EXAMPLE)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def body(example: ModuleType) -> Body:
    cushion: Body = example.Cushion()
    return cushion


def test_it_keeps_the_laws_of_a_body(body: Body) -> None:
    testing: Any = pytest.importorskip("cohaptic_server.testing.check_body")
    testing.check_body(body)


def test_a_push_on_every_vertex_moves_it_by_the_springs_alone(body: Body) -> None:
    """The sheet carries nothing when everything moves alike: u = force / (foundation * area)."""
    vertices = np.arange(len(body.mesh.vertices))
    area = float(body.mesh.quadrature.areas.sum())
    corners = body.mesh.quadrature.vertices
    fraction = np.zeros(len(vertices))
    np.add.at(fraction, corners, body.mesh.quadrature.areas[:, None] * np.full((1, 3), 1.0 / 3.0))
    load = Load(vertices, fraction / fraction.sum(), np.array([1.0, 0.0, 0.0]), 2.0)
    moved = body.respond([load]).displacement
    assert moved[:, 0] == pytest.approx(2.0 / (FOUNDATION * area), rel=1e-6)
    assert np.abs(moved[:, 1:]).max() < 1e-12


def test_two_people_feel_each_other_in_it(body: Body) -> None:
    session = VirtualSession(body)
    session.join("left", HandScript(math.pi, depth=0.02, rhythm=Rhythm(4.0)), delay=0.05)
    right = session.join("right", HandScript(0.0, depth=0.01), delay=0.05)
    session.run(8.0)
    felt = np.array(right.felt[4000:])
    assert felt.max() - felt.min() > 0.1  # N, through the springs and the sheet


@pytest.fixture
def address() -> Iterator[str]:
    command = [sys.executable, str(EXAMPLE), "0"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as server:
        assert server.stdout is not None
        yield server.stdout.readline().split()[1]
        server.terminate()


def test_it_is_served_and_touched(address: str) -> None:
    code = "from cohaptic_client.cli import touch; import typer; typer.run(touch)"
    options = ["--duration", "60", "--depth-mm", "20", "--json-lines", "--wait", "60"]
    command = [sys.executable, "-c", code, address, *options]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as client:
        assert client.stdout is not None
        # A busy machine takes its time: the first force ends the test, and not a clock.
        lines = (line for line in client.stdout if line.startswith("{"))
        touched = any(json.loads(line)["force"] > 0.2 for line in lines)  # N
        client.terminate()
    assert touched
