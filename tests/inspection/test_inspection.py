from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from cohaptic.clock import SystemClock
from cohaptic_server.bodies.solid.shape import SolidSettings
from cohaptic_server.bodies.solid.solid import Solid
from cohaptic_server.objects.build import Built
from cohaptic_server.objects.object_file import ObjectFile
from cohaptic_server.objects.prepare import Prepared
from cohaptic_server.objects.surface.checks import SurfaceReport
from cohaptic_server.testing.blocks import block
from cohaptic_tools.inspection.inspection import (
    Inspection,
    TickCost,
    describe_file,
    inspect_object,
)

pytestmark = pytest.mark.live

WANTED = ObjectFile(Path("a.stl"), "z <= 0%", material=SolidSettings(order=1), scale=0.001)
GOOD = SurfaceReport(0, 0, 0, 1, 1e6, 100.0)


def look(size: tuple[float, float, float], cells: tuple[int, int, int]) -> Inspection:
    tets = block(size, cells)
    solid = Solid(tets, tets.vertices[:, 2] <= 0.0, WANTED.material)
    return inspect_object(WANTED, Built(solid, Prepared(tets, None)), SystemClock())


def test_stiffness_is_that_of_presses_and_infinite_where_it_is_held() -> None:
    found = look((0.1, 0.1, 0.1), (5, 5, 5))
    mesh = found.solid.mesh
    assert np.array_equal(np.isinf(found.stiffness), mesh.vertices[:, 2] <= 0.0)
    top = found.stiffness[mesh.vertices[:, 2] >= 0.1]
    low = found.stiffness[np.isclose(mesh.vertices[:, 2], 0.02)]
    assert top.min() > 0.0
    assert np.median(low) > np.median(top)
    assert found.mass == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("report", "simplified", "words"),
    [
        (GOOD, 0, "in one piece: nothing was repaired"),
        (GOOD, 500, "simplified to 500 at your word"),
        (SurfaceReport(3, 0, 0, 1, 1e6, 100.0), 0, "open: 3 edges have one triangle only; closed"),
        (SurfaceReport(0, 0, 0, 2, 1e6, 100.0), 0, "it was in 2 pieces; closed and untangled"),
        (SurfaceReport(0, 0, 0, 1, -1e6, 100.0), 0, "turned outside out"),
        (GOOD, 0, "and its volume to +0.0%"),
    ],
)
def test_what_was_done_to_a_file_is_told(
    report: SurfaceReport, simplified: int, words: str
) -> None:
    prepared = Prepared(block((0.1, 0.1, 0.1), (2, 2, 2)), report, 1200, simplified)
    sentence = "; ".join(describe_file(WANTED, prepared))
    assert sentence.startswith("a surface of 1,200 triangles; ")
    assert words in sentence


def test_a_body_that_would_sway_and_one_that_is_too_costly_come_with_advice() -> None:
    steady = look((0.1, 0.1, 0.1), (3, 3, 3))
    lines = dict(replace(steady, frequency=20.0, cost=TickCost((0.001, 0.002), 0.01)).lines(WANTED))
    assert "--fix" not in lines["frequency"]
    assert "--edge" not in lines["tick"]
    poor = replace(steady, frequency=0.5, cost=TickCost((0.01, 0.11), 0.01))
    lines = dict(poor.lines(WANTED))
    assert "A real one would sway" in lines["frequency"]
    assert "8 users at 60 Hz need ticks below 11 ms: take a coarser mesh (--edge)" in lines["tick"]
