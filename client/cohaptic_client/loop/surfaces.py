"""From a patch to the surface that the loop presses on."""

from __future__ import annotations

from cohaptic.control.geometry import LocalSurface
from cohaptic.control.mesh_surface import MeshSurface, MeshVertex, RestSurface, Surface
from cohaptic.protocol.patch import MIN_COMPLIANCE, Patch
from cohaptic.protocol.rest_mesh import RestMesh


def flat_surface(patch: Patch) -> LocalSurface:
    """The plane or sphere of a patch."""
    return LocalSurface(
        patch.x_free, patch.normal, patch.curvature, patch.c_ii, patch.own_force, patch.u_others
    )


class SurfaceMaker:
    """Makes the local surface of each patch, of any geometry.

    Args:
        mesh: The resting mesh; None for a client that did not ask for mesh patches.
    """

    def __init__(self, mesh: RestMesh | None = None) -> None:
        self._rest = None if mesh is None else RestSurface(mesh.vertices, mesh.faces)

    def __call__(self, patch: Patch) -> Surface:
        """The surface of a patch."""
        near, base = patch.neighbourhood, flat_surface(patch)
        if near is None or self._rest is None:
            return base
        vertices = [
            MeshVertex(
                i,
                (near.scale * u[0], near.scale * u[1], near.scale * u[2]),
                # A stiff vertex beside soft ones may be rounded to no compliance at all.
                max(MIN_COMPLIANCE, near.c_scale * c),
            )
            for i, u, c in zip(near.indices, near.displacements, near.compliances, strict=True)
        ]
        return MeshSurface(self._rest, base, vertices)
