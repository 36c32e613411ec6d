from __future__ import annotations

import numpy as np
import pytest

from cohaptic.errors import RemoteProtocolError
from cohaptic.protocol.quantised_mesh import QuantisedMesh
from cohaptic_server.bodies.balloon.balloon import Balloon
from cohaptic_server.bodies.touched_body import TouchedBody
from cohaptic_server.room.body_frames import BodyFrames, describe


def test_the_sphere_of_a_body_holds_it_and_touches_it(small_balloon: Balloon) -> None:
    info = describe(small_balloon)
    distances = np.linalg.norm(small_balloon.mesh.vertices - np.array(info.center), axis=1)
    assert distances.max() == pytest.approx(info.radius, rel=1e-12)
    assert (info.name, info.contact_radius) == ("balloon", small_balloon.contact_radius)


def test_a_mesh_that_cannot_be_quantised_is_shown_exact(
    small_balloon: Balloon, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(QuantisedMesh, "has_triangles_alone", False)
    frames = BodyFrames(TouchedBody(small_balloon))
    assert frames.shown_mesh() is frames.rest_mesh()


def test_a_body_that_a_frame_cannot_number_is_refused_with_its_size(
    small_balloon: Balloon, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("cohaptic_server.room.body_frames.MAX_VERTICES", 100)
    frames = BodyFrames(TouchedBody(small_balloon))
    assert not frames.has_rest_mesh
    assert not frames.has_touch_mesh
    frames.prepare()
    frames.check_geometry("sphere")
    with pytest.raises(RemoteProtocolError, match="plane or sphere: the body has 162 vertices"):
        frames.check_geometry("mesh")
    with pytest.raises(RemoteProtocolError, match="Hello alone: the body has 162 vertices"):
        frames.check_watchable()
