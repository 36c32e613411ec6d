"""The object of a recorded session, built again for the Green's functions of its surface."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from cohaptic.errors import CohapticError, one_line
from cohaptic.protocol.messages import BodyInfo
from cohaptic.sessions.replay import vertices_and_faces
from cohaptic_server.bodies.body import Body
from cohaptic_server.bodies.green import green_source
from cohaptic_server.objects.catalogue import build_body
from cohaptic_server.touchable import names

# Largest distance between two meshes of one object, as a fraction of its radius: a quantised mesh
# is exact to 2e-5 of it.
_SAME = 1e-4


def recorded_body(
    settings: Mapping[str, Any], info: BodyInfo, mesh: bytes
) -> tuple[Body | None, str]:
    """Return the body of a session if its surface follows from the forces alone.

    Args:
        settings: Settings of the session: `body` with the name of a body in the catalogue,
            `nonlinear`, and `relaxation` [s].
        info: Position and size of the object in the session.
        mesh: Frame of its resting mesh.

    Returns:
        The body, and an empty text; or None, and a sentence that says why scenes without a surface
        show no deformation. The sentence is empty where scenes bring their surface.
    """
    if settings.get("nonlinear") or settings.get("relaxation"):
        return None, ""
    name = settings.get("body")
    if not isinstance(name, str) or name not in names():
        which = one_line(str(name), 60) if name else one_line(info.name, 60)
        return None, _not_shown(f"{which} is no object of the catalogue, and its file is not here")
    try:
        body = build_body(name)
    except CohapticError as error:
        return None, _not_shown(f"{name} cannot be built: {error}")
    if green_source(body) is None:
        return None, ""
    vertices, faces = vertices_and_faces(mesh)
    same = (
        np.shape(vertices) == body.mesh.vertices.shape
        and np.array_equal(np.asarray(faces), body.mesh.faces)
        and float(np.abs(np.asarray(vertices) - body.mesh.vertices).max()) <= _SAME * info.radius
    )
    return (body, "") if same else (None, _not_shown(f"{name} is another object in this version"))


def _not_shown(why: str) -> str:
    return f"The surface is shown at rest: {why}."
