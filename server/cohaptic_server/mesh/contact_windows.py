"""Windows: the vertices round a contact that one patch needs, chosen in one compiled call."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cohaptic_server.mesh.search.window_vertices import WindowVertices
from cohaptic_server.mesh.surface import SurfaceMesh
from cohaptic_server.mesh.touch_mesh import TouchMesh
from cohaptic_server.numeric import Floats, Ints


class Chosen(NamedTuple):
    """Vertices of one window.

    Args:
        vertices: Of the surface, rising, shape (k,).
        fitted: Those of them that the touch mesh has and that face as the contact does, as indices
            into `vertices`, shape (r,).
        touched: Vertices of the touch mesh that are carried, rising, shape (c,).
        carried: The same as indices into `vertices`, shape (c,).
    """

    vertices: Ints
    fitted: Ints
    touched: Ints
    carried: Ints


class ContactWindows:
    """Chooses windows on a surface and its touch mesh.

    Args:
        mesh: The whole surface.
        touch: Its touch mesh.
    """

    def __init__(self, mesh: SurfaceMesh, touch: TouchMesh) -> None:
        n, t = len(mesh.vertices), len(touch.vertices)
        self._spacing = touch.spacing
        self._vertices, self._fitted = np.zeros(n, dtype=np.int64), np.zeros(n, dtype=np.int64)
        self._touched, self._carried = touch.found, np.zeros(t, dtype=np.int64)
        self._search = WindowVertices(
            mesh.near_tree.tree,
            touch.search.tree,
            touch.window,
            self._touched,
            touch.vertices,
            mesh.normals,
            self._vertices,
            self._fitted,
            self._carried,
        )

    def choose(
        self,
        foot: Floats,
        normal: Floats,
        radius: float,
        reach: float,
        path: tuple[Floats, float, float],
        most: int,
    ) -> Chosen:
        """Choose the window of one contact.

        Args:
            foot: Of the contact on the resting surface, shape (3,) [m].
            normal: Outward unit normal of the surface there, shape (3,).
            radius: Round the foot, within which all vertices are taken [m].
            reach: Round the foot, within which those of the touch mesh are taken [m].
            path: Direction of the slide, of any length, shape (3,); length of the path, and largest
                distance from it of a vertex that is carried [m].
            most: Largest number of vertices that are carried; 0 for none.
        """
        found = self._search
        direction, length, half_width = path
        found.choose(
            foot, normal, radius, reach, direction, length, self._spacing, half_width, most
        )
        return Chosen(
            self._vertices[: found.count].copy(),
            self._fitted[: found.fits].copy(),
            self._touched[: found.carries].copy(),
            self._carried[: found.carries].copy(),
        )
