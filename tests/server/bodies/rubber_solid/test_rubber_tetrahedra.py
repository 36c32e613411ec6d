"""A solid large enough for two cores: the physics, and that no thread's timing shows."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable

import numpy as np
import pytest

from cohaptic_server.bodies.body import Load
from cohaptic_server.bodies.rubber_solid import rubber_tetrahedra
from cohaptic_server.bodies.rubber_solid.rubber_solid import RubberSolid, RubberSolidResponse
from cohaptic_server.bodies.solid.shape import SolidSettings
from cohaptic_server.cholesky import refactor
from cohaptic_server.testing.soft_ring import TUBE, ring
from tests.compiled_modules import compiled_module
from tests.server.bodies.presses import press

TICKS = 6


def large() -> RubberSolid:
    mesh = ring(14, 8)
    return RubberSolid(mesh, mesh.vertices[:, 2] < -0.6 * TUBE, SolidSettings(young=2e4))


def presses(body: RubberSolid, along: float, force: float) -> list[Load]:
    return [press(body, (1, along, 0.4), force), press(body, (-1, -along, 0.4), force)]


def slide(body: RubberSolid) -> list[RubberSolidResponse]:
    """Two hands press and slide; the responses of all ticks."""
    response, found = body.respond([]), list[RubberSolidResponse]()
    for tick in range(TICKS):
        response = body.respond(presses(body, 0.03 * tick, 2.0), response)
        found.append(response)
    return found


@pytest.fixture(scope="module", autouse=True)
def _compiled() -> None:  # as plain Python a tick of this size takes seconds
    compiled_module("cohaptic_server.cholesky.elimination")
    compiled_module("cohaptic_server.bodies.rubber_solid.element_loops")


def in_turn(first: Callable[[], object], second: Callable[[], object]) -> tuple[object, object]:
    other = second()
    return first(), other


def test_results_are_those_of_one_thread_to_the_last_bit(monkeypatch: pytest.MonkeyPatch) -> None:
    """Whichever half comes first."""
    found = slide(large())
    monkeypatch.setattr(refactor, "both", in_turn)
    monkeypatch.setattr(rubber_tetrahedra, "both", in_turn)
    for one, other in zip(found, slide(large()), strict=True):
        assert (one.displacement == other.displacement).all()
        assert (one.compliance == other.compliance).all()
        assert (one.fields == other.fields).all()


def test_it_comes_to_equilibrium_and_the_compliance_is_its_derivative() -> None:
    """The contact's own compliance by a finite difference of settled states: not understated."""
    body = large()

    def settled(extra: float, start: RubberSolidResponse | None = None) -> RubberSolidResponse:
        loads = presses(body, 0.1, 2.0)
        loads[0] = Load(
            loads[0].vertices, loads[0].weights, loads[0].direction, loads[0].force + extra
        )
        for _ in range(25):
            start = body.respond(loads, start)
        assert start is not None
        external = np.zeros_like(body.shape.nodes)
        for load in loads:
            nodes = body.shape.surface[load.vertices]
            external[nodes] += load.force * load.weights[:, None] * load.direction
        residual = body.rubber.residual(start.iterate.state, external)
        assert np.abs(residual[~body.shape.fixed]).max() < 1e-8
        return start

    at = settled(0.0)
    h, load = 0.01, presses(body, 0.1, 2.0)[0]
    moved = settled(h, at).displacement - settled(-h, at).displacement
    slope = float(load.weights @ (moved[load.vertices] @ load.direction)) / (2.0 * h)
    assert at.compliance[0, 0] == pytest.approx(slope, rel=1e-3)


def test_each_part_of_a_moving_tick_is_shared_by_two_cores(monkeypatch: pytest.MonkeyPatch) -> None:
    """Work counted: forces, tangent, factor, and each substitution forward and backward."""
    body, work = large(), Counter[str]()
    for module, name in ((refactor, "factor"), (rubber_tetrahedra, "elements")):
        original = module.both

        def counting(
            *parts: Callable[[], object],
            name: str = name,
            both: Callable[..., object] = original,
        ) -> object:
            work[name] += 1
            return both(*parts)

        monkeypatch.setattr(module, "both", counting)
    response = body.respond(presses(body, 0.0, 2.0), body.respond([]))
    work.clear()
    body.respond(presses(body, 0.05, 2.0), response)
    assert work["elements"] in (2, 3)  # forces once or twice, and the tangent
    assert work["factor"] == 1 + 2 * 3  # three solutions: the step, and all loads refined
