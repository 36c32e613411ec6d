"""What a tick of a nonlinear body costs, counted and not timed."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from cohaptic_server.bodies.balloon import constant_volume_solver
from cohaptic_server.bodies.balloon.balloon import BalloonSettings
from cohaptic_server.bodies.balloon.constant_volume_solver import ConstantVolumeFactor
from cohaptic_server.bodies.balloon.filled_sheet import FilledSheet
from cohaptic_server.bodies.balloon.rubber_balloon import RubberBalloon
from cohaptic_server.bodies.balloon.rubber_sheet import RubberSheet
from cohaptic_server.bodies.newton import MAX_STEPS
from cohaptic_server.bodies.rubber_solid.rubber_solid import RubberSolid
from cohaptic_server.bodies.rubber_solid.rubber_tetrahedra import RubberTetrahedra
from cohaptic_server.bodies.solid.shape import SolidSettings
from cohaptic_server.cholesky import refined
from cohaptic_server.cholesky.refactor import Refactored
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


def test_work_of_a_solid(monkeypatch: pytest.MonkeyPatch) -> None:
    """In motion one tangent, one factor, one solution for step and loads together."""
    mesh = block((0.1, 0.08, 0.06), (2, 2, 2))
    body = RubberSolid(mesh, mesh.vertices[:, 2] < 0.005, SolidSettings(2e4, 0.45, 0.02))
    work = Counter[str]()
    for name in ("at", "tangent"):
        counted(monkeypatch, work, RubberTetrahedra, name)
    for name in ("forward", "_forward"):
        counted(monkeypatch, work, Refactored, name)
    counted(monkeypatch, work, refined, "Refactored")
    ticks = script(body, work)
    for tick in ticks:
        assert tick["tangent"] == tick["Refactored"] <= 1
        assert tick["at"] <= 3
        # Of the step before the tangent one, of step and loads one and one to refine them.
        assert tick["_forward"] <= 4
    moving = ticks[PRESS : PRESS + SLIDE]
    assert sum(tick["tangent"] for tick in moving) >= SLIDE - 2
    # At rest nothing is evaluated: the residual's step, and the loads' fields.
    assert ticks[-1]["at"] == ticks[-1]["tangent"] == 0
    assert ticks[-1]["_forward"] <= 3


def test_work_of_a_balloon(monkeypatch: pytest.MonkeyPatch) -> None:
    body = RubberBalloon(BalloonSettings(subdivisions=2, contact_radius=0.03))
    work = Counter[str]()
    counted(monkeypatch, work, RubberSheet, "tangent")
    counted(monkeypatch, work, FilledSheet, "displaced")
    counted(monkeypatch, work, ConstantVolumeFactor, "solve")
    counted(monkeypatch, work, constant_volume_solver, "Refactored")
    ticks = script(body, work)
    for tick in ticks:
        assert tick["tangent"] == tick["Refactored"] <= MAX_STEPS
        assert tick["solve"] <= tick["tangent"] + 2
        assert tick["displaced"] <= MAX_STEPS + 1
    assert ticks[-1]["tangent"] == ticks[-1]["displaced"] == 0
    assert ticks[-1]["solve"] == 2
    assert np.mean([tick["tangent"] for tick in ticks[:PRESS]]) > 0.3
