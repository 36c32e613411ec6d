"""Makes, from a patch, the surface that the loop presses on."""

from __future__ import annotations

import sys
from array import array

from cohaptic.control.geometry import LocalSurface
from cohaptic.control.mesh_fit import RestSurface, unpack
from cohaptic.control.mesh_surface import MeshSurface, Surface
from cohaptic.protocol.patch import MIN_COMPLIANCE, Patch
from cohaptic.protocol.rest_mesh import RestMesh
from cohaptic.vec import norm


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
        words = array("h", near.items)
        if sys.byteorder == "big":
            words.byteswap()
        # Rounding may leave a stiff vertex beside soft ones without any compliance.
        facts = unpack(words, near.scale, near.c_scale, MIN_COMPLIANCE)
        # With friction the finger sticks to the material and moves with it when others move it.
        moved = 0.0 if patch.compliance is not None else norm(patch.u_others)
        return MeshSurface(self._rest, base, facts, moved)
