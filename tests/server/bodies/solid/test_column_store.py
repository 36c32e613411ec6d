from __future__ import annotations

import numpy as np
import pytest

from cohaptic_server.bodies.body import Load
from cohaptic_server.bodies.solid.column_store import ColumnStore
from cohaptic_server.bodies.solid.green_columns import ColumnRequest, GreenColumns
from cohaptic_server.bodies.solid.places import PLACE
from cohaptic_server.bodies.solid.shape import SolidSettings
from cohaptic_server.bodies.solid.solid import MIN_TOUCH_TICKS, Solid
from cohaptic_server.mesh.surface import pressure
from cohaptic_server.numeric import Floats, Ints
from cohaptic_server.testing.blocks import block
from tests.server.bodies.solid.test_far_field import soft_ring

DOWN = np.array([0.0, 0.0, -1.0])


def test_columns_that_are_in_use_stay_and_others_go(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("cohaptic_server.bodies.solid.column_store.MIN_CAPACITY", 40)
    mesh = block((0.1, 0.1, 0.1), (4, 4, 4))
    settings = SolidSettings(contact_radius=0.02)
    small = Solid(mesh, mesh.vertices[:, 2] < 0.01, settings)
    small.columns = type(small.columns)(
        small.columns.factor, small.shape.free_index, small.mesh.vertices, 1
    )
    small.in_background()
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


def read(store: ColumnStore, vertex: int, rows: Ints) -> Floats:
    """One column at some rows, as a contact on its vertex reads it, shape (k, 3, 3) [m/N]."""
    out, counted, found = np.empty(9), np.empty(1), list[Floats]()
    at, far = store.slot[[vertex]], (1e6, 2e6)
    for row in rows:
        one = np.array([row])
        kind = store.kind[[vertex]]
        store.kernel.block(
            one, np.zeros(1, np.int64), np.ones(1), np.zeros(3), *far, kind, at, np.ones(1),
            counted, out,
        )  # fmt: skip
        found.append(out.reshape(3, 3).copy())
    return np.array(found)


@pytest.mark.parametrize("reach", [None, 0.03, 1.0])
def test_a_column_of_some_places_is_read_where_it_was_found(reach: float | None) -> None:
    """Also where columns have room for all places, as on a small body; the rest is zero."""
    body = soft_ring()
    columns = GreenColumns(body.columns.factor, body.shape.free_index, body.mesh.vertices, 2**28)
    if reach is not None:
        columns.keep(reach)
    vertex = 500
    kept = columns.store.places_of(np.array([vertex]))
    some = kept[:: 2 if len(kept) > 1 else 1]
    column = columns.solve(ColumnRequest(np.array([vertex]), some))[0]
    assert columns.store.put(column, 1.0)
    rows = np.arange(0, len(body.mesh.vertices), 41)
    force = np.eye(3)[None]
    true = columns.respond(np.array([vertex]), force).reshape(3, -1, 3)[:, rows].swapaxes(0, 1)
    here = np.isin(columns.places.rank[rows] // PLACE, some)
    assert here.any()
    moved = read(columns.store, vertex, rows)
    assert moved[here] == pytest.approx(true[here], rel=1e-5, abs=1e-9)
    assert not moved[~here].any()
