from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cohaptic_server.bodies.body import Load
from cohaptic_server.bodies.solid.green_columns import ColumnRequest, GreenColumns
from cohaptic_server.bodies.solid.parts import SolidParts
from cohaptic_server.bodies.solid.solid import FADE_IN_TICKS, Solid, SolidResponse
from cohaptic_server.numeric import Floats
from tests.examples_of_laws import examples
from tests.server.bodies.solid.test_far_field import Place, far_field, places, soft_ring, touch


def background() -> Solid:
    """The ring as it is served, before any column is solved."""
    body = soft_ring()
    parts = SolidParts(body.shape, body.columns.factor, far_field())
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
    """Ticks of the same loads, each with the columns that a worker would deliver."""
    response = body.respond(loads)
    for _ in range(ticks):
        body.solve_missing(64)
        response = body.respond(loads)
    assert isinstance(response, SolidResponse)
    return response


@given(st.lists(st.tuples(places, st.floats(0.0, 5.0)), min_size=1, max_size=4))
@settings(max_examples=examples(10), deadline=None)
def test_with_its_columns_it_is_exact_near_and_almost_so_far_away(
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
    gap = response.displacement_of(above) - true.displacement[above]
    assert np.abs(gap).max() <= 0.08 * dent * total + 1e-12


@given(
    st.lists(places, min_size=2, max_size=6),
    st.lists(st.integers(0, 100), max_size=40),
    st.lists(st.floats(0.0, 1.0), min_size=40, max_size=40),
)
@settings(max_examples=examples(25), deadline=None)
def test_c_is_symmetric_and_definite_with_any_columns(
    where: list[Place], known: list[int], fractions: list[float]
) -> None:
    """Science 3.6, with any part of the columns under the contacts found, and fading in."""
    body = background()
    loads = [press(place, 1.0) for place in where]
    touched = np.unique(np.concatenate([load.vertices for load in loads]))
    chosen = np.unique(touched[np.array(known, dtype=np.int64) % len(touched)])
    if len(chosen):
        x = body.mesh.vertices
        body.columns = GreenColumns(body.columns.factor, body.shape.free_index, x, 2**28)  # whole
        order = ColumnRequest(chosen, np.arange(body.columns.places.count))
        for column, fraction in zip(body.columns.solve(order), fractions, strict=False):
            body.columns.store.put(column, fraction)
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
    reported, true = list[Floats](), list[Floats]()
    for tick in range(240):
        if tick % 7 == 0:
            body.solve_missing(24)
        finger = press((0.6 * math.sin(0.03 * tick), 1.2), 1.0)  # up to 60 mm/s at 60 Hz
        for solid, found in ((body, reported), (whole, true)):
            response = solid.respond([finger, other])
            free = response.without(slice(0, 1), np.ones(1), finger.vertices)
            u_others = float(finger.weights @ free @ finger.direction)
            found.append(np.array([response.compliance[0, 0], u_others]))
    # C changes along the body itself; only the excess over that comes from the columns.
    over = np.abs(np.diff(reported, axis=0)) - np.abs(np.diff(true, axis=0))
    assert over.max() < 0.01 * np.max(true)


@given(places, st.lists(st.tuples(places, st.floats(0.1, 5.0)), min_size=2, max_size=4))
@settings(max_examples=examples(10), deadline=None)
def test_loads_of_one_contact_are_as_those_of_several(
    place: Place, turns: list[tuple[Place, float]]
) -> None:
    """A contact with friction has three loads on the same arrays, which are evaluated once."""
    body = background()
    stays = press(place, 1.0)
    serve(body, [stays], 5)  # some of the columns, and these not in full
    shared = [Load(stays.vertices, stays.weights, -touch(t)[2], f) for t, f in turns]
    apart = [replace(load, vertices=load.vertices.copy()) for load in shared]
    one, other = body.respond(shared), body.respond(apart)
    assert isinstance(one, SolidResponse)
    assert len(one.contacts) == 1
    at = body.mesh.near(stays.weights @ body.mesh.vertices[stays.vertices], 0.06)
    assert one.displacement_of(at) == pytest.approx(other.displacement_of(at), abs=1e-12)
    assert one.compliance == pytest.approx(other.compliance, rel=1e-9)
    forces = np.array([load.force for load in shared[:1]])
    assert one.without(slice(0, 1), forces, at) == pytest.approx(
        other.without(slice(0, 1), forces, at), abs=1e-12
    )
