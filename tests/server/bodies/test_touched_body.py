from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from cohaptic.errors import BodyError
from cohaptic_server.bodies.balloon.balloon import Balloon, BalloonSettings
from cohaptic_server.bodies.body import DenseResponse, Load, Response
from cohaptic_server.bodies.spring import Spring
from cohaptic_server.bodies.touched_body import TouchedBody, vertex_compliance
from cohaptic_server.mesh.surface import pressure


def test_compliance_of_the_vertices_is_that_of_contacts_there(small_balloon: Balloon) -> None:
    mesh, table = small_balloon.mesh, vertex_compliance(small_balloon)
    for k in range(0, len(table), 7):
        vertices, weights = pressure(mesh, mesh.vertices[k], small_balloon.contact_radius)
        dof = (3 * vertices[:, None] + np.arange(3)).ravel()
        share = (weights[:, None] * mesh.normals[k]).ravel()
        direct = share @ small_balloon.compliance[np.ix_(dof, dof)] @ share
        assert table[k] == pytest.approx(direct, rel=1e-9, abs=1e-15)


def test_compliance_is_found_when_asked_for_and_once() -> None:
    class Counting(Balloon):
        responses = 0

        def respond(self, loads: Sequence[Load], before: Response | None = None) -> DenseResponse:
            self.responses += 1
            return super().respond(loads, before)

    body = Counting(BalloonSettings(subdivisions=2, contact_radius=0.03))
    touched = TouchedBody(body)
    assert body.responses == 0
    first = touched.vertex_compliance
    assert body.responses == len(body.mesh.vertices)
    assert touched.vertex_compliance is first
    assert body.responses == len(body.mesh.vertices)


def test_a_body_of_another_kind_has_a_table_too() -> None:
    plate = Spring()
    expected = plate.respond(
        [Load(np.array([0]), np.array([1.0]), -plate.mesh.normals[0], 0.0)]
    ).compliance[0, 0]
    assert vertex_compliance(plate) == pytest.approx(expected)


def test_the_touch_mesh_is_made_once(small_balloon: Balloon) -> None:
    touched = TouchedBody(small_balloon)
    assert touched.mesh is touched.mesh


def test_a_press_that_pulls_outwards_is_named_and_not_taken_for_held() -> None:
    class Wrong(Balloon):
        def respond(self, loads: Sequence[Load], before: Response | None = None) -> DenseResponse:
            r = super().respond(loads, before)
            return DenseResponse(r.displacement, r.fields, -r.compliance, r.energy)

    body = Wrong(BalloonSettings(subdivisions=2, contact_radius=0.03))
    with pytest.raises(BodyError, match=r"C_ii of a press at vertex \d+ is -.* not negative"):
        vertex_compliance(body)
