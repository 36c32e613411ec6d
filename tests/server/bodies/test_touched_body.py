from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from cohaptic.errors import BodyError
from cohaptic_server.bodies.balloon.balloon import Balloon, BalloonSettings
from cohaptic_server.bodies.body import DenseResponse, Load, Response
from cohaptic_server.bodies.touched_body import TouchedBody, vertex_compliance
from cohaptic_server.mesh.surface import pressure


def test_compliance_of_the_vertices_is_that_of_contacts_there(small_balloon: Balloon) -> None:
    mesh, table = small_balloon.mesh, vertex_compliance(small_balloon)
    for k in range(0, len(table), 7):
        vertices, weights = pressure(mesh, mesh.vertices[k], small_balloon.contact_radius)
        dof = (3 * vertices[:, None] + np.arange(3)).ravel()
        fraction = (weights[:, None] * mesh.normals[k]).ravel()
        direct = fraction @ small_balloon.compliance[np.ix_(dof, dof)] @ fraction
        assert table[k] == pytest.approx(direct, rel=1e-9, abs=1e-15)


def test_a_body_is_asked_once_for_each_vertex_that_touch_needs() -> None:
    """A fine mesh opens its room as soon as a coarse one."""

    class Counting(Balloon):
        asked = 0

        def respond(self, loads: Sequence[Load], before: Response | None = None) -> DenseResponse:
            self.asked += 1
            return super().respond(loads, before)

    body = Counting(BalloonSettings(subdivisions=3, contact_radius=0.05))
    touched = TouchedBody(body)
    vertices = touched.mesh.vertices
    assert len(vertices) < 0.5 * len(body.mesh.vertices)
    assert np.array_equal(touched.touch_compliance, vertex_compliance(body)[vertices])
    assert body.asked == len(vertices) + len(body.mesh.vertices)


def test_a_press_that_pulls_outwards_is_named_and_not_taken_for_held() -> None:
    class Wrong(Balloon):
        def respond(self, loads: Sequence[Load], before: Response | None = None) -> DenseResponse:
            r = super().respond(loads, before)
            return DenseResponse(r.displacement, r.fields, -r.compliance, r.energy)

    body = Wrong(BalloonSettings(subdivisions=2, contact_radius=0.03))
    with pytest.raises(BodyError, match=r"C_ii of a press at vertex \d+ is -.* not negative"):
        vertex_compliance(body)
