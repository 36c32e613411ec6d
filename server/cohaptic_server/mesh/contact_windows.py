"""Windows: the vertices round a contact that one patch needs, chosen in compiled loops."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cohaptic_server.mesh.search.window_vertices import WindowVertices
from cohaptic_server.mesh.surface import SurfaceMesh
from cohaptic_server.mesh.touch_mesh import TouchMesh
from cohaptic_server.numeric import Ints


@dataclass(frozen=True, eq=False, slots=True)
class ContactWindows:
    """The search for windows on a surface and its touch mesh, and where it leaves what it finds.

    Args:
        search: For one window after the other.
        vertices: Of the surface, rising, shape (n,); the first `search.count` hold.
        fitted: Those of them that the touch mesh has and that face as the contact does, as indices
            into `vertices`, shape (n,); the first `search.fits` hold.
        touched: Vertices of the touch mesh that are carried, rising, shape (t,); the first
            `search.carries` hold.
        carried: The same as indices into `vertices`, shape (t,).
    """

    search: WindowVertices
    vertices: Ints
    fitted: Ints
    touched: Ints
    carried: Ints

    @classmethod
    def on(cls, mesh: SurfaceMesh, touch: TouchMesh) -> ContactWindows:
        """The search on a whole surface and its touch mesh."""
        n, t = len(mesh.vertices), len(touch.vertices)
        vertices, fitted = np.zeros(n, dtype=np.int64), np.zeros(n, dtype=np.int64)
        touched, carried = touch.found, np.zeros(t, dtype=np.int64)
        search = WindowVertices(
            mesh.near_tree.tree,
            touch.search.tree,
            touch.window,
            touched,
            touch.vertices,
            mesh.normals,
            vertices,
            fitted,
            carried,
        )
        return cls(search, vertices, fitted, touched, carried)
