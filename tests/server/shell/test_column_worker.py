from __future__ import annotations

from multiprocessing import active_children

import numpy as np
import pytest

from cohaptic.clock import SystemClock
from cohaptic_server.bodies.body import Load
from cohaptic_server.bodies.solid.shape import SolidSettings
from cohaptic_server.bodies.solid.solid import Solid
from cohaptic_server.mesh.pressure import pressure
from cohaptic_server.shell.column_worker import ColumnWorker
from cohaptic_server.testing.blocks import block

PATIENCE = 30.0  # s


def test_a_worker_brings_what_a_tick_wants_until_nothing_is_wanted() -> None:
    mesh = block((0.1, 0.1, 0.1), (4, 4, 4))
    held = mesh.vertices[:, 2] < 0.01
    body, whole = (Solid(mesh, held, SolidSettings(contact_radius=0.02)) for _ in range(2))
    spots = [pressure(body.mesh, np.array([x, 0.0, 0.1]), 0.02) for x in (-0.02, 0.03)]
    loads = [Load(v, w, np.array([0.0, 0.0, -1.0]), 1.0) for v, w in spots]
    worker = ColumnWorker(body)
    worker.start()
    clock = SystemClock()
    end = clock.now() + PATIENCE
    response = body.respond(loads)
    try:
        while clock.now() < end:
            worker.pump()
            response = body.respond(loads)
            if (
                not len(body.missing)
                and (body.columns.store.share[body.columns.store.slot[spots[0][0]]] == 1).all()
            ):
                break
    finally:
        worker.stop()
    assert not len(body.missing)
    true = whole.respond(loads).compliance
    assert np.diag(response.compliance) == pytest.approx(np.diag(true), rel=1e-3)
    kept = body.columns.store.kept
    body.prefetch(np.arange(5))
    body.respond(loads)
    worker.pump()  # it has stopped: nothing comes, and nothing is wrong
    body.respond(loads)
    assert body.columns.store.kept == kept


def test_the_end_of_the_process_is_said_once_and_the_solid_goes_on(
    caplog: pytest.LogCaptureFixture,
) -> None:
    mesh = block((0.1, 0.1, 0.1), (4, 4, 4))
    body = Solid(mesh, mesh.vertices[:, 2] < 0.01, SolidSettings(contact_radius=0.02))
    v, w = pressure(body.mesh, np.array([0.0, 0.0, 0.1]), 0.02)
    load = Load(v, w, np.array([0.0, 0.0, -1.0]), 1.0)
    worker = ColumnWorker(body)
    worker.start()
    (process,) = (child for child in active_children() if child.name == "columns")
    process.kill()
    process.join(PATIENCE)
    try:
        for _ in range(3):
            body.prefetch(np.arange(5))
            assert body.respond([load]).compliance[0, 0] > 0.0
            worker.pump()
    finally:
        worker.stop()
    said = [record for record in caplog.records if "has ended" in record.getMessage()]
    assert len(said) == 1
