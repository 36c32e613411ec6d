from __future__ import annotations

import numpy as np
import pytest

from cohaptic_server.bodies.body import Load
from cohaptic_server.bodies.solid.green_columns import ColumnRequest, GreenColumns
from cohaptic_server.bodies.solid.shape import SolidSettings
from cohaptic_server.bodies.solid.solid import MIN_TOUCH_TICKS, Solid
from cohaptic_server.mesh.pressure import pressure
from cohaptic_server.testing.blocks import block
from tests.server.bodies.solid.test_far_field import soft_ring

DOWN = np.array([0.0, 0.0, -1.0])


def test_columns_that_are_in_use_stay_and_others_go(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("cohaptic_server.bodies.solid.column_store.MIN_CAPACITY", 40)
    mesh = block((0.1, 0.1, 0.1), (4, 4, 4))
    settings = SolidSettings(contact_radius=0.02)
    small = Solid(mesh, mesh.vertices[:, 2] < 0.01, settings)
    small.in_background()
    small.columns = type(small.columns)(small.columns.factor, small.shape.free_index, 1)
    loads = [
        Load(*pressure(small.mesh, np.array([x, 0.0, 0.1]), 0.02), DOWN, 1.0)
        for x in np.linspace(-0.04, 0.04, 9)
    ]
    for load in loads:
        for _ in range(2 * MIN_TOUCH_TICKS):
            small.solve_missing(16)
            small.respond([load])
        assert (small.columns.store.slot[load.vertices] >= 0).all()
        assert small.columns.store.kept <= 40


def test_a_column_of_some_rows_is_read_where_it_was_found() -> None:
    """Also where columns have room for all rows, as on a small body."""
    body = soft_ring()
    columns = GreenColumns(body.columns.factor, body.shape.free_index, 2**28)
    rows = np.arange(5, len(body.mesh.vertices), 7)
    vertex = int(rows[len(rows) // 2])
    column = columns.solve(ColumnRequest(np.array([vertex]), rows))[0]
    assert columns.store.put(column, 1.0)
    moved = columns.store.sums(columns.store.slot[[vertex]], np.ones(1), rows)
    assert moved.reshape(-1, 9) == pytest.approx(column.values, rel=1e-6)
    left_out = columns.store.sums(columns.store.slot[[vertex]], np.ones(1), np.array([0, 1]))
    assert not left_out.any()
