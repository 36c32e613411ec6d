from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cohaptic_server.bodies.balloon.balloon import Balloon, BalloonSettings
from cohaptic_server.bodies.touched_body import TouchedBody
from cohaptic_server.numeric import Floats, union
from tests.examples_of_laws import examples
from tests.server.windows import choose

LARGEST = 40  # vertices that are carried: fewer than are near, so that the bound is met


def places() -> st.SearchStrategy[Floats]:
    """Places on and near the balloon, shape (3,) [m]."""
    part = st.floats(-0.11, 0.11)
    return st.tuples(part, part, part).map(np.array)


@pytest.fixture(scope="module")
def touched() -> TouchedBody:
    """A balloon that is touched by a part of its vertices."""
    return TouchedBody(Balloon(BalloonSettings(contact_radius=0.06)))


@given(places(), st.floats(0.0, 0.06), st.floats(0.0, 0.08), st.floats(0.0, 0.1), st.booleans())
@settings(max_examples=examples(60), deadline=None)
def test_a_window_is_what_lies_near_and_what_is_carried(
    touched: TouchedBody, foot: Floats, radius: float, reach: float, length: float, carries: bool
) -> None:
    mesh, touch = touched.body.mesh, touched.mesh
    path = (np.array([0.0, 1.0, 0.5]), length, 0.05)
    normal = foot / max(1e-9, float(np.linalg.norm(foot)))
    found = choose(touched, foot, normal, radius, reach, path, LARGEST if carries else 0)
    near = np.flatnonzero(np.linalg.norm(mesh.vertices - foot, axis=1) <= radius)
    shape = touch.vertices[np.linalg.norm(touch.points - foot, axis=1) <= reach]
    assert found.vertices.tolist() == union(near, shape, touch.vertices[found.touched]).tolist()
    facing = mesh.normals[found.vertices] @ normal > 0.0
    among = np.isin(found.vertices, touch.vertices) & facing
    assert found.fitted.tolist() == np.flatnonzero(among).tolist()
    assert (found.vertices[found.carried] == touch.vertices[found.touched]).all()
    assert len(found.touched) <= (LARGEST if carries else 0)
    assert (np.diff(found.touched) > 0).all()
