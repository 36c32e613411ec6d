from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cohaptic_server.bodies.body import Load
from cohaptic_server.bodies.solid.green_columns import ColumnRequest, GreenColumns
from cohaptic_server.bodies.solid.parts import SolidParts
from cohaptic_server.bodies.solid.response import SolidResponse
from cohaptic_server.bodies.solid.shape import SolidSettings
from cohaptic_server.bodies.solid.solid import FADE_IN_TICKS, MIN_TOUCH_TICKS, Solid
from cohaptic_server.mesh.pressure import pressure
from cohaptic_server.numeric import Floats
from cohaptic_server.testing.blocks import block
from tests.server.bodies.solid.test_far_field import Place, far_field, places, soft_ring, touch

DOWN = np.array([0.0, 0.0, -1.0])


def background() -> Solid:
    """The ring as it is served; with nothing found yet."""
    body = soft_ring()
    parts = SolidParts(body.columns.factor, far_field())
    new = Solid(
        body.shape.tets,
        body.shape.fixed[: len(body.shape.tets.vertices)],
        body.settings,
        parts=parts,
    )
    new.in_background()
    return new


def press(place: Place, force: float) -> Load:
    vertices, weights, normal = touch(place)
    return Load(vertices, weights, -normal, force)


def serve(body: Solid, loads: list[Load], ticks: int = 3 * FADE_IN_TICKS) -> SolidResponse:
    """Ticks of the same loads, each with the columns that a worker would bring."""
    response = body.respond(loads)
    for _ in range(ticks):
        body.solve_missing(64)
        response = body.respond(loads)
    assert isinstance(response, SolidResponse)
    return response


@given(st.lists(st.tuples(places, st.floats(0.0, 5.0)), min_size=1, max_size=4))
@settings(max_examples=10, deadline=None)
def test_once_its_columns_are_there_it_is_exact_near_and_almost_so_afar(
    presses: list[tuple[Place, float]],
) -> None:
    body, whole = background(), soft_ring()
    loads = [press(place, force) for place, force in presses]
    response, true = serve(body, loads), whole.respond(loads)
    assert not len(body.missing)
    dent = np.abs(true.compliance).max()
    assert np.diag(response.compliance) == pytest.approx(np.diag(true.compliance), rel=1e-4)
    assert np.abs(response.compliance - true.compliance).max() < 0.08 * dent
    total = sum(load.force for load in loads)
    above = np.flatnonzero(body.mesh.vertices[:, 2] > -0.01)
    gap = response.at(above) - true.displacement[above]
    assert np.abs(gap).max() <= 0.08 * dent * total + 1e-12


@given(
    st.lists(places, min_size=2, max_size=6),
    st.lists(st.integers(0, 100), max_size=40),
    st.lists(st.floats(0.0, 1.0), min_size=40, max_size=40),
)
@settings(max_examples=25, deadline=None)
def test_c_is_symmetric_and_definite_whatever_is_there(
    where: list[Place], known: list[int], shares: list[float]
) -> None:
    """Science 3.6, with any part of the columns under the contacts found, and fading in."""
    body = background()
    loads = [press(place, 1.0) for place in where]
    touched = np.unique(np.concatenate([load.vertices for load in loads]))
    chosen = np.unique(touched[np.array(known, dtype=np.int64) % len(touched)])
    if len(chosen):
        body.columns = GreenColumns(body.columns.factor, body.shape.free_index, 2**28)  # whole ones
        order = ColumnRequest(chosen, np.arange(len(body.mesh.vertices)))
        for column, share in zip(body.columns.solve(order), shares, strict=False):
            body.columns.store.put(column, share)
    response = body.respond(loads)
    C = response.compliance
    assert (C == C.T).all()
    distinct = np.unique(np.round(where, 2), axis=0)
    if len(distinct) == len(where):
        assert np.linalg.eigvalsh(C).min() > -1e-4 * np.abs(C).max()
    assert (np.diag(C) > 0.0).all()


def test_a_finger_that_slides_meets_no_step_whatever_columns_come() -> None:
    """C_ii and the neighbour's displacement change little from tick to tick, columns or not."""
    body, whole = background(), soft_ring()
    other = press((0.3, 1.5), 2.0)
    told, true = list[Floats](), list[Floats]()
    for tick in range(240):
        if tick % 7 == 0:
            body.solve_missing(24)
        finger = press((0.6 * math.sin(0.03 * tick), 1.2), 1.0)  # up to 60 mm/s at 60 Hz
        for solid, found in ((body, told), (whole, true)):
            response = solid.respond([finger, other])
            free = response.without(slice(0, 1), np.ones(1), finger.vertices)
            u_others = float(finger.weights @ free @ finger.direction)
            found.append(np.array([response.compliance[0, 0], u_others]))
    # The body itself changes under a finger that slides: what is over that comes from the columns.
    over = np.abs(np.diff(told, axis=0)) - np.abs(np.diff(true, axis=0))
    assert over.max() < 0.01 * np.max(true)


def test_without_a_load_is_what_the_others_do() -> None:
    body = background()
    loads = [press((0.0, 1.0), 2.0), press((0.4, 1.5), 1.0), press((2.0, 1.0), 3.0)]
    both = serve(body, loads)
    others = body.respond([loads[0], loads[2]])
    at = np.arange(0, len(body.mesh.vertices), 7)
    free = both.without(slice(1, 2), np.array([1.0]), at)
    assert free == pytest.approx(others.at(at), abs=1e-12)
    part = both.without(slice(1, 2), np.array([0.25]), at)
    mine = body.respond([loads[1]]).at(at)
    assert part == pytest.approx(others.at(at) + 0.75 * mine, abs=1e-9)


def test_what_is_ahead_is_found_after_what_is_touched() -> None:
    body = background()
    ahead = press((2.0, 1.0), 0.0).vertices
    body.prefetch(ahead)
    load = press((0.0, 1.0), 1.0)
    body.respond([load])
    assert set(body.missing) == set(ahead.tolist())  # a finger may be on its way across
    for _ in range(MIN_TOUCH_TICKS):
        body.respond([load])
    assert set(body.missing[: len(load.vertices)]) == set(load.vertices.tolist())
    assert set(body.missing[len(load.vertices) :]) == set(ahead.tolist())
    heaviest = load.vertices[load.weights.argmax()]
    assert body.missing[0] == heaviest


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


@given(places, st.lists(st.tuples(places, st.floats(0.1, 5.0)), min_size=1, max_size=6))
@settings(max_examples=10, deadline=None)
def test_what_is_remembered_of_a_place_changes_nothing(
    place: Place, turns: list[tuple[Place, float]]
) -> None:
    """A finger stays where it is, and the direction of its force turns from tick to tick."""
    body = background()
    serve(body, [press(place, 1.0)])
    stays = press(place, 1.0)
    frozen = body.mesh.near(stays.weights @ body.mesh.vertices[stays.vertices], 0.03)
    asked = frozen.copy()
    frozen.setflags(write=False)
    for towards, force in turns:
        load = Load(stays.vertices, stays.weights, -touch(towards)[2], force)
        response = body.respond([load])
        assert isinstance(response, SolidResponse)
        remembered = response.at(frozen)
        assert remembered == pytest.approx(response.at(asked), abs=1e-15)
        assert (response.at(frozen) == remembered).all()
        assert len(response.loads[0].contact.corrections) == 1  # of what may change nothing is kept


def test_a_column_of_some_rows_is_read_where_it_was_found() -> None:
    """Also where columns have room for all rows, as on a small body."""
    body = background()
    columns = GreenColumns(body.columns.factor, body.shape.free_index, 2**28)
    rows = np.arange(5, len(body.mesh.vertices), 7)
    vertex = int(rows[len(rows) // 2])
    column = columns.solve(ColumnRequest(np.array([vertex]), rows))[0]
    assert columns.store.put(column, 1.0)
    moved = columns.store.sums(columns.store.slot[[vertex]], np.ones(1), rows)
    assert moved.reshape(-1, 9) == pytest.approx(column.values, rel=1e-6)
    left_out = columns.store.sums(columns.store.slot[[vertex]], np.ones(1), np.array([0, 1]))
    assert not left_out.any()
