"""Finds the window of a contact: vertices round it, for `bodies/touched_body.py`.

A window holds vertices of the whole surface. Some of these are also vertices of the touch mesh,
which numbers them differently. One call finds all vertices that a patch needs, and writes them to
arrays of the caller.
"""

from __future__ import annotations

import numpy as np

from cohaptic_server.mesh.search.point_tree import PointTree
from cohaptic_server.mesh.search.window_search import WindowSearch
from cohaptic_server.numeric import Floats, Ints


class WindowVertices:
    """Chooses the vertices of windows on one surface.

    Args:
        surface: Tree of the n vertices of the surface.
        touch: Tree of the t vertices of its touch mesh.
        ahead: Search along a path over the touch mesh.
        touched: Array to which `ahead` writes vertices of the touch mesh, shape (t,).
        members: Index in the surface of each vertex of the touch mesh, in rising order, shape (t,).
        normals: Outward unit normals of the whole surface, shape (n, 3).
        vertices: Array for the vertices of a window, in rising order, shape (n,); the first `count`
            are valid.
        fitted: Array for the positions in the window of vertices of the touch mesh that face the
            same way as the contact, shape (n,); the first `fits` are valid.
        carried: Array for the positions in the window of the vertices in `touched`, shape (t,); the
            first `carries` are valid.
    """

    def __init__(
        self, surface: PointTree, touch: PointTree, ahead: WindowSearch, touched: Ints,
        members: Ints, normals: Floats, vertices: Ints, fitted: Ints, carried: Ints,
    ) -> None:  # fmt: skip
        self.surface = surface
        self.touch = touch
        self.ahead = ahead
        self.touched = touched
        self.members = members
        self.normals = normals
        self.vertices = vertices
        self.fitted = fitted
        self.carried = carried
        self.count = self.fits = self.carries = 0
        self.found = np.zeros(len(vertices), dtype=np.int64)
        self.place = np.full(len(vertices), -1, dtype=np.int64)
        self.member = np.zeros(len(vertices), dtype=np.int8)
        for k in range(members.shape[0]):
            self.member[members[k]] = 1

    def choose(
        self,
        start: Floats,
        normal: Floats,
        radius: float,
        reach: float,
        direction: Floats,
        length: float,
        step: float,
        half_width: float,
        limit: int,
    ) -> None:
        """Find the window of a contact, and write it to `vertices`, `fitted` and `carried`.

        Args:
            start: Foot of the contact, shape (3,) [m].
            normal: Outward unit normal of the contact, shape (3,).
            radius: Radius round the foot within which all vertices are taken [m].
            reach: Radius round the foot within which vertices of the touch mesh are taken [m].
            direction: Direction of the slide, of any length, shape (3,).
            length: Length of the path along which vertices of the touch mesh are taken [m].
            step: Distance between two points of the path [m].
            half_width: Largest distance of these vertices from the path [m].
            limit: Largest number of these vertices; 0 if none are taken.
        """
        x, y, z = start[0], start[1], start[2]
        self.count = 0
        near = self.surface.within(x, y, z, radius, self.found)
        for k in range(near):
            self.add(self.found[k])
        near = self.touch.within(x, y, z, reach, self.found)
        for k in range(near):
            self.add(self.members[self.found[k]])
        self.carries = 0
        if limit > 0:
            self.carries = self.ahead.along(
                start, normal, direction, length, step, half_width, limit
            )
        self.touch.sort(self.touched, self.carries)
        for k in range(self.carries):
            self.add(self.members[self.touched[k]])
        self.touch.sort(self.vertices, self.count)
        self.fits = 0
        for k in range(self.count):
            vertex = self.vertices[k]
            self.place[vertex] = k
            if self.member[vertex] == 0:
                continue
            facing = (
                normal[0] * self.normals[vertex, 0]
                + normal[1] * self.normals[vertex, 1]
                + normal[2] * self.normals[vertex, 2]
            )
            if facing > 0.0:
                self.fitted[self.fits] = k
                self.fits += 1
        for k in range(self.carries):
            self.carried[k] = self.place[self.members[self.touched[k]]]
        for k in range(self.count):
            self.place[self.vertices[k]] = -1

    def add(self, vertex: int | Ints) -> None:
        """Add a vertex to the window unless the window has it already."""
        if self.place[vertex] < 0:
            self.place[vertex] = 0
            self.vertices[self.count] = vertex
            self.count += 1
