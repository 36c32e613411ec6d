"""What a tick of a nonlinear body costs, counted and not timed, and which tangents it believes."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from cohaptic_server.bodies.balloon.rubber_balloon import (
    RubberBalloon,
)
from cohaptic_server.bodies.body import Load
from cohaptic_server.bodies.newton import SOFTENING, NewtonIteration
from cohaptic_server.bodies.rubber_solid.rubber_solid import RubberSolid
from cohaptic_server.bodies.solid.shape import SolidSettings
from cohaptic_server.testing.blocks import block
from tests.server.bodies.presses import press

PRESS, SLIDE, HOLD = 8, 10, 40  # ticks of the script


def counted(monkeypatch: pytest.MonkeyPatch, work: Counter[str], owner: Any, name: str) -> None:
    """Count the calls of a function or method under its name."""
    original: Callable[..., Any] = getattr(owner, name)

    def counting(*args: Any, **options: Any) -> Any:
        work[name] += 1
        return original(*args, **options)

    monkeypatch.setattr(owner, name, counting)


def script(body: RubberSolid | RubberBalloon, work: Counter[str]) -> list[Counter[str]]:
    """Two users press, slide and hold; the work of each tick."""
    ticks: list[Counter[str]] = []
    response = body.respond([])
    for tick in range(PRESS + SLIDE + HOLD):
        force = 1.5 * min(1.0, (tick + 1) / PRESS)
        along = 0.02 * min(max(0, tick - PRESS), SLIDE)
        loads = [press(body, (1, along, 0.4), force), press(body, (-1, -along, 0.4), force)]
        work.clear()
        response = body.respond(loads, response)
        ticks.append(Counter(work))
    return ticks


def strut_loads(solid: RubberSolid, force: float) -> list[Load]:
    """A force [N] down on the top, and none sideways."""
    top = np.flatnonzero(solid.mesh.vertices[:, 2] > 0.0999)
    even = np.full(len(top), 1.0 / len(top))
    down, sideways = np.array([0.0, 0.0, -1.0]), np.array([1.0, 0.0, 0.0])
    return [Load(top, even, down, force), Load(top, even, sideways, 0.0)]


def test_a_tangent_that_is_all_but_singular_is_not_believed() -> None:
    """That of a strut just below the load at which it buckles, sideways."""
    mesh = block((0.01, 0.01, 0.1), (1, 1, 8))
    solid = RubberSolid(mesh, mesh.vertices[:, 2] < 1e-9, SolidSettings(2e4, 0.3, 0.008))
    newton = NewtonIteration(solid.rubber)
    response = solid.respond(strut_loads(solid, 0.0))
    at_rest = float(response.compliance[1, 1])
    largest = reported = 0.0
    # Euler's load of this strut is 4.1 mN; it is neared in ever smaller steps.
    force, step = 0.0, 1e-3
    while step > 1e-8:
        tried = response
        for _ in range(8):
            tried = solid.respond(strut_loads(solid, force + step), tried)
        tangent = tried.iterate.tangent
        if not tangent.stable or np.abs(tried.displacement[:, :2]).max() > 1e-3:
            step *= 0.3
            continue
        force, response = force + step, tried
        fractions = np.zeros((2, *solid.shape.nodes.shape))
        for i, load in enumerate(strut_loads(solid, force)):
            at = solid.shape.surface[load.vertices]
            fractions[i, at] = load.weights[:, None] * load.direction
        fields = newton.fields(tangent, fractions)
        largest = max(largest, float((fractions[1] * fields[1]).sum()) / at_rest)
        reported = max(reported, float(response.compliance[1, 1]) / at_rest)
    assert 3e-3 < force < 5e-3
    assert largest > 10.0 * SOFTENING
    assert 2.0 < reported <= 1.001 * SOFTENING
