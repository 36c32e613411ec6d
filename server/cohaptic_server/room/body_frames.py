"""The protocol's description of a body: bounding sphere, and frames of the meshes."""

from __future__ import annotations

from collections.abc import Sized

import numpy as np

from cohaptic.errors import RemoteProtocolError
from cohaptic.protocol.messages import BodyInfo
from cohaptic.protocol.quantised_mesh import QuantisedMesh
from cohaptic.protocol.rest_mesh import MAX_FACES, MAX_VERTICES, RestMesh
from cohaptic_server.bodies.body import Body
from cohaptic_server.bodies.touched_body import TouchedBody
from cohaptic_server.numeric import Floats, Ints, vec3


def describe(body: Body) -> BodyInfo:
    """Return name, contact radius and bounding sphere of a body, in the form that clients are sent.

    The centre of the sphere is that of the bounding box.
    """
    x = body.mesh.vertices
    center = 0.5 * (x.min(axis=0) + x.max(axis=0))
    radius = float(((x - center) ** 2).sum(axis=1).max() ** 0.5)
    return BodyInfo(
        name=body.name,
        center=vec3(center),
        radius=radius,
        contact_radius=body.contact_radius,
        origin=body.mesh.origin,
    )


class BodyFrames:
    """Encoded frames of a body's mesh at rest and of its touch mesh; each frame is encoded once.

    The touch mesh is the surface mesh from which mesh patches are cut.

    Args:
        touched_body: The deformable object and its touch mesh.
    """

    def __init__(self, touched_body: TouchedBody) -> None:
        self._touched_body = touched_body
        self._rest_mesh: bytes | None = None
        self._shown_mesh: bytes | None = None
        self._touch_mesh: bytes | None = None

    @property
    def has_rest_mesh(self) -> bool:
        """Whether the body's mesh fits into one frame, so that watchers can be shown the body."""
        mesh = self._touched_body.body.mesh
        return _fits(mesh.vertices, mesh.faces)

    @property
    def has_touch_mesh(self) -> bool:
        """Whether the touch mesh fits into one frame, so that users can have mesh patches."""
        mesh = self._touched_body.mesh
        return _fits(mesh.vertices, mesh.faces)

    def check_watchable(self) -> None:
        """Raise RemoteProtocolError if the body's mesh is too large to be shown to watchers."""
        if not self.has_rest_mesh:
            mesh = self._touched_body.body.mesh
            reason = _too_large(mesh.vertices, mesh.faces)
            raise RemoteProtocolError("message", "Watch", f"Hello alone: {reason}")

    def check_geometry(self, geometry: str) -> None:
        """Raise RemoteProtocolError if the body is too large for patches of this geometry."""
        if geometry == "mesh" and not self.has_touch_mesh:
            mesh = self._touched_body.mesh
            limit = f"plane or sphere: {_too_large(mesh.vertices, mesh.faces)}"
            raise RemoteProtocolError("geometry", geometry, limit)

    def rest_mesh(self) -> bytes:
        """Return the frame of the mesh at rest with exact coordinates."""
        if self._rest_mesh is None:
            mesh = self._touched_body.body.mesh
            self._rest_mesh = _encode(mesh.vertices, mesh.faces)
        return self._rest_mesh

    def shown_mesh(self) -> bytes:
        """Return the frame of the mesh at rest with quantised coordinates.

        If quantisation makes faces degenerate, the method returns the frame of the exact mesh
        instead.
        """
        if self._shown_mesh is None:
            mesh = self._touched_body.body.mesh
            quantised = QuantisedMesh.of(mesh.vertices, mesh.faces.astype(np.int64))
            whole = quantised.has_triangles_alone
            self._shown_mesh = quantised.encode() if whole else self.rest_mesh()
        return self._shown_mesh

    def touch_mesh(self) -> bytes:
        """Return the frame of the touch mesh, for a user with mesh patches.

        The method also computes everything else that mesh patches need, since a tick has no time
        for it.
        """
        if self._touch_mesh is None:
            _ = self._touched_body.touch_compliance, self._touched_body.windows
            mesh = self._touched_body.mesh
            self._touch_mesh = _encode(mesh.points, mesh.faces)
        return self._touch_mesh

    def prepare(self) -> None:
        """Encode in advance all frames that the body's size allows, so that no user waits for them.

        The method also prepares the contact search, which takes longer than a tick on a fine mesh.
        """
        _ = self._touched_body.body.mesh.contacts, self._touched_body.body.mesh.near_tree
        if self.has_rest_mesh:
            self.rest_mesh()
            self.shown_mesh()
        if self.has_touch_mesh:
            self.touch_mesh()


def _fits(vertices: Sized, faces: Sized) -> bool:
    return len(vertices) <= MAX_VERTICES and len(faces) <= MAX_FACES


def _too_large(vertices: Sized, faces: Sized) -> str:
    return (
        f"the body has {len(vertices)} vertices and {len(faces)} faces,"
        f" a frame can number {MAX_VERTICES} and {MAX_FACES}"
    )


def _encode(vertices: Floats, faces: Ints) -> bytes:
    points, corners = vertices.tolist(), faces.tolist()
    mesh = RestMesh(tuple((x, y, z) for x, y, z in points), tuple((a, b, c) for a, b, c in corners))
    return mesh.encode()
