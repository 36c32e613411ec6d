from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from cohaptic.protocol.messages import BodyInfo
from cohaptic.protocol.quantised_mesh import QuantisedMesh
from cohaptic_server.bodies.balloon.balloon import Balloon
from cohaptic_server.bodies.green import green_source, model_name
from cohaptic_server.bodies.touched_body import TouchedBody
from cohaptic_server.numeric import Floats
from cohaptic_server.objects.recorded_body import recorded_body
from cohaptic_server.room.body_frames import BodyFrames, describe


@pytest.fixture(scope="module")
def balloon() -> Balloon:
    return Balloon()


def test_the_body_of_the_catalogue_has_the_functions_that_it_had_in_the_room(
    balloon: Balloon,
) -> None:
    frames = BodyFrames(TouchedBody(balloon))
    source = green_source(balloon)
    assert source is not None
    for mesh in (frames.shown_mesh(), frames.rest_mesh()):
        body, why = recorded_body({"body": "balloon"}, describe(balloon), mesh)
        assert body is not None
        assert why == ""
        found = green_source(body)
        assert found is not None
        assert model_name(found) == model_name(source)


@pytest.mark.parametrize("more", [{"nonlinear": True}, {"relaxation": 0.02}])
def test_a_body_whose_scenes_have_their_surface_is_not_built(
    balloon: Balloon, more: dict[str, Any]
) -> None:
    assert recorded_body({"body": "balloon", **more}, describe(balloon), b"") == (None, "")


@pytest.mark.parametrize("name", ["liver.obj", "../balloon", "nobody's", "", None, 3, ["balloon"]])
def test_a_body_that_is_not_at_hand_is_told(balloon: Balloon, name: object) -> None:
    body, why = recorded_body({"body": name}, describe(balloon), b"")
    assert body is None
    assert why.startswith("The surface is shown at rest: ")
    assert why.endswith(".")


def moved(mesh: Floats, by: float) -> Floats:
    return np.asarray(mesh + np.array([by, 0.0, 0.0]))


def test_another_object_of_the_same_name_is_not_taken_for_it(balloon: Balloon) -> None:
    info: BodyInfo = describe(balloon)
    faces = balloon.mesh.faces.astype(np.int64)
    for by, same in ((1e-7, True), (0.01, False)):
        frame = QuantisedMesh.of(moved(balloon.mesh.vertices, by), faces).encode()
        body, why = recorded_body({"body": "balloon"}, info, frame)
        assert (body is not None) is same
        assert ("another object" in why) is not same
