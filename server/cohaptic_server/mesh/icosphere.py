"""A sphere of nearly equal triangles."""

from __future__ import annotations

import numpy as np

from cohaptic_server.numeric import Floats, Ints


def icosphere(subdivisions: int, radius: float) -> tuple[Floats, Ints]:
    """A subdivided icosahedron on a sphere; each subdivision quadruples the faces.

    Returns:
        Vertices (n, 3) [m] and faces (m, 3); n is 42, 162, 642, 2562 for 1 to 4 subdivisions.
    """
    # Not with the module: a third of a second, which a server of another body does not need.
    import trimesh

    sphere = trimesh.creation.icosphere(  # pyright: ignore[reportUnknownMemberType]
        subdivisions=subdivisions, radius=radius
    )
    return np.array(sphere.vertices, dtype=np.float64), np.array(sphere.faces, dtype=np.int64)
