"""Finds the point of a resting surface nearest to a given point."""

from __future__ import annotations

import numpy as np

from cohaptic_server.mesh.search.point_tree import PointTree
from cohaptic_server.numeric import Floats, Ints


class NearestSearch:
    """Searches the faces of one surface for the point nearest to a given point.

    Args:
        vertices: Resting positions, shape (n, 3) [m].
        faces: Corners of the faces, shape (m, 3).
        around: Faces that share a vertex with each face, shape (m, 3 valence).
        tree: Tree of the quadrature points, which are numbered face after face.
        split: Number of quadrature points of a face.

    Attributes:
        foot: The point that was found last, shape (3,) [m].
        face: Face on which the foot lies.
    """

    def __init__(
        self, vertices: Floats, faces: Ints, around: Ints, tree: PointTree, split: int
    ) -> None:
        self.vertices = vertices
        self.faces = faces
        self.around = around
        self.tree = tree
        self.split = split
        self.foot = np.zeros(3)
        self.face = 0

    def nearest(self, x: float, y: float, z: float) -> None:
        """Move the foot to the point of the resting surface nearest to (x, y, z) [m].

        The search covers the face of the nearest quadrature point and the faces round this face.
        """
        face = self.tree.nearest(x, y, z) // self.split
        best = 1e300
        for k in range(self.around.shape[1]):
            square = self.nearer(self.around[face, k], x, y, z, best)
            if square < best:
                best = square
                self.face = self.around[face, k]

    def nearer(self, face: int, x: float, y: float, z: float, best: float) -> float:
        """Move the foot to the point of a face nearest to (x, y, z), if it is nearer than before.

        The nearest point is the foot of the perpendicular to the face's plane if that lies inside
        the face, else the nearest point of an edge.

        Args:
            best: Squared distance of the present foot [m^2].

        Returns:
            The lesser of `best` and the squared distance of the face [m^2].
        """
        a, b, c = self.faces[face, 0], self.faces[face, 1], self.faces[face, 2]
        ax, ay, az = self.vertices[a, 0], self.vertices[a, 1], self.vertices[a, 2]
        ux, uy, uz = self.vertices[b, 0] - ax, self.vertices[b, 1] - ay, self.vertices[b, 2] - az
        vx, vy, vz = self.vertices[c, 0] - ax, self.vertices[c, 1] - ay, self.vertices[c, 2] - az
        wx, wy, wz = x - ax, y - ay, z - az
        uu, uv, vv = (
            ux * ux + uy * uy + uz * uz,
            ux * vx + uy * vy + uz * vz,
            vx * vx + vy * vy + vz * vz,
        )
        wu, wv = wx * ux + wy * uy + wz * uz, wx * vx + wy * vy + wz * vz
        det = max(uu * vv - uv * uv, 1e-300)
        s, t = (vv * wu - uv * wv) / det, (uu * wv - uv * wu) / det
        if s >= 0.0 and t >= 0.0 and s + t <= 1.0:
            return self.nearer_point(ax, ay, az, s, t, ux, uy, uz, vx, vy, vz, x, y, z, best)
        # The nearest points of the three edges, as shares of `u` and `v`.
        s = min(1.0, max(0.0, wu / max(uu, 1e-300)))
        best = self.nearer_point(ax, ay, az, s, 0.0, ux, uy, uz, vx, vy, vz, x, y, z, best)
        t = min(1.0, max(0.0, wv / max(vv, 1e-300)))
        best = self.nearer_point(ax, ay, az, 0.0, t, ux, uy, uz, vx, vy, vz, x, y, z, best)
        along = (wv - wu - uv + uu) / max(uu - 2.0 * uv + vv, 1e-300)
        t = min(1.0, max(0.0, along))
        return self.nearer_point(ax, ay, az, 1.0 - t, t, ux, uy, uz, vx, vy, vz, x, y, z, best)

    def nearer_point(
        self,
        ax: float, ay: float, az: float, s: float, t: float,
        ux: float, uy: float, uz: float, vx: float, vy: float, vz: float,
        x: float, y: float, z: float, best: float,
    ) -> float:  # fmt: skip
        """Move the foot to the point p = a + s u + t v if p is nearer to (x, y, z) than before.

        Args:
            ax, ay, az: First corner a of a face [m].
            ux, uy, uz, vx, vy, vz: Edges u and v of the face from this corner [m].
            best: Squared distance of the present foot [m^2].

        Returns:
            The lesser of `best` and the squared distance of p [m^2].
        """
        px, py, pz = ax + s * ux + t * vx, ay + s * uy + t * vy, az + s * uz + t * vz
        square = (x - px) * (x - px) + (y - py) * (y - py) + (z - pz) * (z - pz)
        if square >= best:
            return best
        self.foot[0] = px
        self.foot[1] = py
        self.foot[2] = pz
        return square
