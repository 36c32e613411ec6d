"""What a tick does, counted: rows of columns, and calls. No clock decides."""

from __future__ import annotations

import functools
import math
import sys
from typing import Any

import numpy as np
import pytest

from cohaptic_server.bodies.body import Load
from cohaptic_server.bodies.solid.far_field import build_far_field
from cohaptic_server.bodies.solid.parts import SolidParts
from cohaptic_server.bodies.solid.shape import SolidSettings
from cohaptic_server.bodies.solid.solid import Solid
from cohaptic_server.mesh.surface import pressure
from cohaptic_server.objects.surface.accept import nearest_point
from cohaptic_server.testing.soft_ring import RING, TUBE, fixed, ring

FINGERS = 3
_SAMPLES = 120
_TICKS = 12

Work = tuple[float, float]  # rows of columns and calls, per tick


@functools.cache
def served(along: int, across: int, radius: float) -> Solid:
    """A ring as it is served."""
    mesh = ring(along, across)
    whole = Solid(mesh, fixed(mesh), SolidSettings(2e4, 0.4, radius, order=1))
    factor, nodes = whole.columns.factor, whole.shape.free_index
    far_field = build_far_field(whole.mesh, radius, factor, nodes, count=_SAMPLES)
    parts = SolidParts(whole.shape, whole.columns.factor, far_field)
    body = Solid(mesh, fixed(mesh), whole.settings, parts=parts)
    body.in_background()
    return body


def work(body: Solid, slide: float) -> Work:
    """Ticks of fingers that move by `slide` contact radii in each, with all of their columns."""
    calls, rows = list[int](), list[int]()
    kernel = body.columns.store.kernel
    for tick in range(_TICKS):
        loads: list[Load] = []
        for finger in range(FINGERS):
            angle = 2.0 * finger * body.contact_radius / RING
            angle += slide * tick * body.contact_radius / RING
            top = np.array([RING * math.cos(angle), RING * math.sin(angle), TUBE])
            under, shares = pressure(body.mesh, nearest_point(body.mesh, top), body.contact_radius)
            loads.append(Load(under, shares, np.array([0.0, 0.0, -1.0]), 1.0))
        touched = np.unique(np.concatenate([load.vertices for load in loads]))
        body.missing = touched[body.columns.store.slot[touched] < 0]
        while len(body.missing):
            body.solve_missing(64)
            body.respond(loads[:1])
            body.missing = touched[body.columns.store.slot[touched] < 0]
        windows = [
            body.mesh.near(
                load.weights @ body.mesh.vertices[load.vertices], 2 * body.contact_radius
            )
            for load in loads
        ]
        before, count = kernel.rows_read, [0]

        def seen(frame: Any, event: str, argument: Any, count: list[int] = count) -> None:
            # Calls of kernels are not counted: plain ones call each other, compiled ones do not.
            kernels = "kernels" in frame.f_code.co_filename
            count[0] += event in ("call", "c_call") and not kernels

        sys.setprofile(seen)
        response = body.respond(loads)
        assert response.compliance.shape == (FINGERS, FINGERS)
        for k, window in enumerate(windows):
            response.without(slice(k, k + 1), np.ones(1), window)
        sys.setprofile(None)
        calls.append(count[0])
        rows.append(kernel.rows_read - before)
    return float(np.mean(rows[2:])), float(np.mean(calls[2:]))


@pytest.mark.slow
def test_the_work_of_a_tick_does_not_grow_with_the_mesh() -> None:
    """Contacts of as many vertices read as many rows in as many calls, on four times the mesh."""
    coarse, fine = served(32, 20, 0.02), served(64, 40, 0.01)
    assert len(fine.mesh.vertices) == 4 * len(coarse.mesh.vertices)
    (rows, calls), (more_rows, more_calls) = work(coarse, 0.3), work(fine, 0.3)
    assert rows > 0
    # On the coarse mesh, where contacts are larger, some of their surroundings are out of reach.
    assert more_rows < 1.6 * rows
    assert more_calls < 1.1 * calls


def test_sliding_is_as_cheap_as_pressing() -> None:
    """Nothing is remembered from tick to tick, so that a finger that moves misses nothing."""
    body = served(64, 40, 0.01)
    (rows, calls), (sliding_rows, sliding_calls) = work(body, 0.0), work(body, 0.3)
    assert sliding_rows == pytest.approx(rows, rel=0.2)
    assert sliding_calls == pytest.approx(calls, rel=0.1)
