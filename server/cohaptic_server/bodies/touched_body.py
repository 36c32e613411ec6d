"""A body with its touch mesh, from which mesh patches are cut, and a table of vertex compliances.

Touch mesh and table are computed on first use and at most once: the table takes one response of the
body for each vertex of the touch mesh, and a room without mesh patches does not need it.

Compiled loops choose the window of a patch: the vertices round a contact that the patch needs.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Protocol, runtime_checkable

import numpy as np

from cohaptic.errors import BodyError
from cohaptic.protocol.patch import MAX_COMPLIANCE
from cohaptic_server.bodies.body import Body, Prefetching, Swings
from cohaptic_server.bodies.vertex_presses import presses_at
from cohaptic_server.mesh.search.window_vertices import WindowVertices
from cohaptic_server.mesh.surface import SurfaceMesh
from cohaptic_server.mesh.touch_mesh import APART, TouchMesh, thinned
from cohaptic_server.numeric import Floats, Ints


@dataclass(frozen=True, eq=False, slots=True)
class ContactWindows:
    """A search for windows on a surface and its touch mesh, with the arrays for its results.

    Args:
        search: Search for one window at a time.
        vertices: Vertices of the surface in the window, rising, shape (n,); the first
            `search.count` entries are valid.
        fitted: Vertices of the window that are in the touch mesh and face the same way as the
            contact, as indices into `vertices`, shape (n,); the first `search.fits` are valid.
        touched: Vertices of the touch mesh that a patch contains, rising, shape (t,); the first
            `search.carries` are valid.
        carried: The vertices in `touched` as indices into `vertices`, shape (t,).
    """

    search: WindowVertices
    vertices: Ints
    fitted: Ints
    touched: Ints
    carried: Ints

    @classmethod
    def on(cls, mesh: SurfaceMesh, touch: TouchMesh) -> ContactWindows:
        """Return a search on a whole surface and its touch mesh."""
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


# As a share of the largest C_ii: a negative C_ii this small is a rounding error at a fixed vertex.
_ROUNDING = 1e-6


@runtime_checkable
class Surveyed(Protocol):
    """A body that computes its table of compliances faster than by one response per vertex."""

    def vertex_compliance(self) -> Floats:
        """Return the compliance of a contact at each vertex along its normal, shape (n,) [m/N]."""
        ...


@dataclass(frozen=True, eq=False)
class TouchedBody:
    """A body with its touch mesh and its table of vertex compliances."""

    body: Body

    @cached_property
    def prefetching(self) -> Prefetching | None:
        """The body if it uses announcements of vertices that fingers will press, else None."""
        return self.body if isinstance(self.body, Prefetching) else None

    @cached_property
    def swings(self) -> Swings | None:
        """The body if it has mass, else None."""
        return self.body if isinstance(self.body, Swings) else None

    @cached_property
    def mesh(self) -> TouchMesh:
        """The mesh from which mesh patches are cut."""
        return thinned(self.body.mesh, APART * self.body.contact_radius)

    @cached_property
    def windows(self) -> ContactWindows:
        """Search for windows round contacts, for patches that contain more than a plane."""
        return ContactWindows.on(self.body.mesh, self.mesh)

    @cached_property
    def touch_compliance(self) -> Floats:
        """Compliance at the vertices of the touch mesh, within the protocol's range, (t,) [m/N].

        The table is that of the body at rest; the client scales it by the compliance `c_ii` at the
        contact of each patch.
        """
        return np.minimum(vertex_compliance(self.body, self.mesh.vertices), MAX_COMPLIANCE)


def vertex_compliance(body: Body, vertices: Ints | None = None) -> Floats:
    """Return the compliance of a contact at some vertices along their normals, shape (k,) [m/N].

    This is the diagonal entry C_ii of the compliance matrix for a contact centred at the vertex; 0
    means that the vertex is fixed. The table of a `Surveyed` body is its own; any other body
    responds once for each vertex.

    Args:
        body: Body at rest.
        vertices: Vertices to press, shape (k,); None for all.

    Raises:
        BodyError: A press moves the surface under it outwards.
    """
    if isinstance(body, Surveyed):
        whole = body.vertex_compliance()
        return whole if vertices is None else whole[vertices]
    if vertices is None:
        vertices = np.arange(len(body.mesh.vertices))
    presses = presses_at(body.mesh, vertices, body.contact_radius)
    table = np.array([float(body.respond([load]).compliance[0, 0]) for load in presses])
    worst = int(table.argmin())
    if table[worst] < -_ROUNDING * table.max():
        raise BodyError(
            f"{body.name}: C_ii of a press at vertex {vertices[worst]} is {table[worst]:.3g} m/N;"
            " that of an elastic body is not negative"
        )
    return np.asarray(np.maximum(0.0, table))
