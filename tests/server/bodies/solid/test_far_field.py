from __future__ import annotations

import functools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cohaptic.errors import BodyError
from cohaptic_server.bodies.solid.far_field import FarField, build_far_field
from cohaptic_server.bodies.solid.shape import SolidSettings
from cohaptic_server.bodies.solid.solid import Solid
from cohaptic_server.mesh.surface import pressure
from cohaptic_server.numeric import Floats, Ints
from cohaptic_server.objects.surface.accept import nearest_point
from cohaptic_server.testing.soft_ring import RING, TUBE, fixed, ring
from tests.examples_of_laws import examples

Place = tuple[float, float]  # angles along the ring and round its tube

# More than a contact above the fixed part.
places = st.tuples(st.floats(-math.pi, math.pi), st.floats(-0.2, math.pi + 0.2))
directions = st.tuples(*[st.floats(-1, 1)] * 3).filter(lambda d: np.linalg.norm(d) > 0.2)


@functools.cache
def soft_ring() -> Solid:
    """16,560 tetrahedra on a table, a contact of 15 mm."""
    mesh = ring(60, 32)
    return Solid(mesh, fixed(mesh), SolidSettings(2e4, 0.4, 0.015, order=1))


@functools.cache
def far_field() -> FarField:
    body = soft_ring()
    factor, nodes = body.columns.factor, body.shape.free_index
    return build_far_field(body.mesh, body.contact_radius, factor, nodes, count=300)


def touch(place: Place) -> tuple[Ints, Floats, Floats]:
    """Vertices and weights of a contact, and the outward normal."""
    body, (a, b) = soft_ring(), place
    n = np.array([math.cos(a) * math.cos(b), math.sin(a) * math.cos(b), math.sin(b)])
    middle = np.array([RING * math.cos(a), RING * math.sin(a), 0.0])
    at = nearest_point(body.mesh, middle + TUBE * n)
    return *pressure(body.mesh, at, body.contact_radius), n


def true_field(vertices: Ints, weights: Floats, direction: Floats) -> Floats:
    """Displacement of the surface per unit force, solved directly, shape (n, 3) [m/N]."""
    force = (weights[:, None] * direction)[:, :, None]
    return soft_ring().columns.respond(vertices, force).reshape(-1, 3)


def by_samples(vertices: Ints, weights: Floats, direction: Floats) -> Floats:
    """Displacement of the samples per unit force, shape (m, 3) [m/N]."""
    found = far_field()
    per_force = np.empty((3, len(found.samples), 3))
    found.respond(found.spread(vertices, weights), per_force)
    return np.asarray(np.tensordot(direction, per_force, axes=1))


@given(places, places, directions, directions)
@settings(max_examples=examples(30), deadline=None)
def test_far_away_it_agrees_with_the_solid(
    one: Place, two: Place, d: tuple[float, ...], e: tuple[float, ...]
) -> None:
    """Two sample spacings away the displacement is that of the solid, to 8 % of the dent."""
    found = far_field()
    vertices, weights, _ = touch(one)
    push = np.array(d) / np.linalg.norm(d)
    true = true_field(vertices, weights, push)
    reported = found.interpolated(by_samples(vertices, weights, push), np.arange(len(true)))
    x = soft_ring().mesh.vertices
    far = np.linalg.norm(x - weights @ x[vertices], axis=1) > 2.0 * found.spacing
    dent = np.linalg.norm(true, axis=1).max()
    gap = np.linalg.norm(reported - true, axis=1)
    assert gap[far].max() < 0.08 * dent
    # What it says of two contacts does not depend on which of them pushes.
    other, fractions, _ = touch(two)
    pull = np.array(e) / np.linalg.norm(e)
    back = found.interpolated(by_samples(other, fractions, pull), vertices)
    there = found.interpolated(by_samples(vertices, weights, push), other)
    assert weights @ back @ push == pytest.approx(fractions @ there @ pull, abs=1e-5 * dent)


@given(places)
@settings(max_examples=examples(30), deadline=None)
def test_a_contact_is_as_soft_as_the_contacts_round_it(place: Place) -> None:
    found = far_field()
    vertices, weights, n = touch(place)
    true = float(weights @ true_field(vertices, weights, -n)[vertices] @ -n)
    assert found.self_compliance(vertices, weights, -n) == pytest.approx(true, rel=0.06)


def test_it_comes_back_from_arrays() -> None:
    found = far_field()
    again = FarField.from_arrays(found.to_arrays())
    assert again.spacing == found.spacing
    for name in ("samples", "near", "carries", "compliance", "own"):
        assert (getattr(again, name) == getattr(found, name)).all()
    arrays = found.to_arrays()
    beyond = arrays | {"near": found.near + len(found.samples)}
    with pytest.raises(BodyError, match="do not fit"):
        FarField.from_arrays(beyond)
    del arrays["near"]
    with pytest.raises(BodyError, match="near"):
        FarField.from_arrays(arrays)
