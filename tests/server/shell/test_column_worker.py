from __future__ import annotations

import logging
import os
import threading
from collections.abc import Callable
from multiprocessing import active_children
from pathlib import Path

import numpy as np
import pytest

from cohaptic.clock import SystemClock
from cohaptic_server.bodies.body import Load
from cohaptic_server.bodies.green import decode_block, green_source
from cohaptic_server.bodies.solid.parts import SolidParts
from cohaptic_server.bodies.solid.shape import SolidSettings
from cohaptic_server.bodies.solid.solid import Solid
from cohaptic_server.mesh.surface import pressure
from cohaptic_server.objects.store.store import load_or_make_parts
from cohaptic_server.shell import column_worker
from cohaptic_server.shell.column_worker import ColumnWorker, Unsolved
from cohaptic_server.testing.blocks import block
from tests.patience import PATIENCE

pytestmark = pytest.mark.alone


def end_process() -> None:
    """As the system does that has no more memory."""
    (process,) = (child for child in active_children() if child.name == "columns")
    process.kill()
    process.join(PATIENCE)


SETTINGS = SolidSettings(contact_radius=0.02)
MESH = block((0.1, 0.1, 0.1), (4, 4, 4))
HELD = MESH.vertices[:, 2] < 0.01


@pytest.fixture
def stored(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> tuple[Path, Callable[[], Solid]]:
    """The entry of a prepared solid, and starts that leave its factor where it is."""
    monkeypatch.setenv("COHAPTIC_CACHE", str(tmp_path))

    def parts() -> SolidParts:
        return load_or_make_parts(MESH, HELD, SETTINGS, lambda phase, fraction: None, late=True)

    parts()
    (path,) = tmp_path.iterdir()
    return path, lambda: Solid(MESH, HELD, SETTINGS, parts=parts())


def pumped(worker: ColumnWorker, body: Solid, until: Callable[[], bool]) -> bool:
    """Tick with a finger on the top until something holds; whether it did in time."""
    v, w = pressure(body.mesh, np.array([0.0, 0.0, 0.1]), 0.02)
    clock = SystemClock()
    end = clock.now() + PATIENCE
    while clock.now() < end and not until():
        worker.pump()
        # Felt in every tick, whether columns come or not.
        assert body.respond([Load(v, w, np.array([0.0, 0.0, -1.0]), 1.0)]).compliance[0, 0] > 0.0
    return until()


def test_a_process_that_was_killed_is_started_again_and_pages_get_what_they_asked_for(
    stored: tuple[Path, Callable[[], Solid]],
    caplog: pytest.LogCaptureFixture,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(column_worker, "_PAUSE", 0.05)
    caplog.set_level(logging.INFO)
    body = stored[1]()
    worker = ColumnWorker(body)
    worker.start()
    found: list[bytes] = []
    try:
        assert pumped(worker, body, lambda: body.columns.store.kept > 8)
        end_process()
        asking = threading.Thread(target=lambda: found.append(worker.green_block(7)), daemon=True)
        asking.start()
        assert pumped(worker, body, lambda: bool(found))
        body.columns.store.grow(2 * body.columns.store.capacity)  # it forgets them: all are missing
        assert pumped(worker, body, lambda: body.columns.store.kept > 8)
    finally:
        worker.stop()
    said = [
        record.getMessage() for record in caplog.records if record.name == column_worker.__name__
    ]
    assert len(said) == 2
    assert "ended by signal 9; it is started again in 0.05 s (1 of 5)" in said[0]
    assert "is back" in said[1]


def test_a_server_reads_no_factor_and_its_worker_solves_with_it(
    stored: tuple[Path, Callable[[], Solid]],
) -> None:
    """Of a prepared object the server maps and copies none of the factor, 800 MB of a large one."""
    path, make = stored
    body, whole = make(), Solid(MESH, HELD, SETTINGS)
    worker = ColumnWorker(body)
    worker.start()
    found: list[bytes] = []
    asking = threading.Thread(target=lambda: found.append(worker.green_block(7)), daemon=True)
    asking.start()
    try:
        assert pumped(worker, body, lambda: body.columns.store.kept > 8 and bool(found))
        maps = Path("/proc/self/maps")
        assert not maps.exists() or str(path) not in maps.read_text()
    finally:
        worker.stop()
    source = green_source(whole)
    assert source is not None
    true = source.green(7)
    assert np.abs(decode_block(found[0]) - true).max() < 1e-3 * np.abs(true).max()


@pytest.mark.parametrize("damage", ["changed", "cut"])
def test_a_factor_damaged_on_the_disk_is_said_and_made_anew_at_the_next_start(
    damage: str, stored: tuple[Path, Callable[[], Solid]], caplog: pytest.LogCaptureFixture
) -> None:
    path, make = stored
    whole = path.read_bytes()
    body = make()
    path.write_bytes(whole[:-99] + bytes(99) if damage == "changed" else whole[: len(whole) // 2])
    worker = ColumnWorker(body)
    worker.start()
    try:
        assert pumped(worker, body, lambda: "is damaged, and was deleted" in caplog.text)
        with pytest.raises(Unsolved):
            worker.green_block(3)
    finally:
        worker.stop()
    assert not path.exists()
    make()
    assert path.stat().st_size == len(whole)


@pytest.mark.skipif(os.name == "nt", reason="Windows keeps others from writing to a mapped file")
@pytest.mark.parametrize("damage", ["changed", "cut"])
def test_a_file_written_to_while_it_is_mapped_gives_no_more_columns(
    damage: str, stored: tuple[Path, Callable[[], Solid]], caplog: pytest.LogCaptureFixture
) -> None:
    path, make = stored
    body = make()
    worker = ColumnWorker(body)
    worker.start()
    try:
        assert pumped(worker, body, lambda: body.columns.store.kept > 0)
        with path.open("r+b") as file:
            if damage == "cut":
                file.truncate(4096)
            else:
                file.write(b"other")
        body.columns.store.grow(2 * body.columns.store.capacity)  # it forgets them: all are missing
        assert pumped(worker, body, lambda: "was changed while it is in use" in caplog.text)
        assert body.columns.store.kept == 0
    finally:
        worker.stop()
