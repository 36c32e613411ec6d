"""A deformed triangle mesh in three dimensions, coloured by how far its surface has moved."""

# pyright: reportUnknownMemberType=false

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib import colormaps
from matplotlib.colors import Normalize
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

from cohaptic_server.mesh.surface import SurfaceMesh, face_area_vectors
from cohaptic_server.numeric import Floats

if TYPE_CHECKING:
    from mpl_toolkits.mplot3d.axes3d import Axes3D

STYLUS = "#B91C1C"
COLORS = colormaps["cividis_r"]
_LIGHT = np.array([0.30, -0.75, 0.59])  # where the light comes from
_VIEW = (16.0, -60.0)  # elevation, azimuth [degrees]: the dent shows in the outline


def draw_mesh(
    axes: Axes3D, mesh: SurfaceMesh, displacement: Floats, probe: Floats, scale: Normalize
) -> None:
    """Draw the displaced surface and the probe.

    Args:
        axes: Three-dimensional.
        mesh: Resting surface.
        displacement: Displacement of its vertices, shape (n, 3) [m].
        probe: Tip, shape (3,) [m].
        scale: From inward movement [mm] to colour.
    """
    x = mesh.vertices + displacement
    areas = face_area_vectors(x, mesh.faces)
    normals = areas / np.linalg.norm(areas, axis=1, keepdims=True)
    resting = face_area_vectors(mesh.vertices, mesh.faces)
    resting /= np.linalg.norm(resting, axis=1, keepdims=True)
    moved = -np.einsum("fi,fi->f", displacement[mesh.faces].mean(axis=1), resting)
    fractions = np.asarray(scale(1e3 * moved), dtype=np.float64)
    colors: Floats = np.array(COLORS(fractions), dtype=np.float64)  # (m, 4)
    # Light from one side, and more than half of it from everywhere.
    colors[:, :3] *= (0.65 + 0.35 * np.clip(normals @ _LIGHT, 0.0, 1.0))[:, None]
    surface = Poly3DCollection(
        1e3 * x[mesh.faces], facecolors=colors, edgecolors=(0, 0, 0, 0.25), linewidths=0.25
    )
    axes.add_collection3d(surface)
    tip = 1e3 * probe
    # The stylus goes straight out; drawn on top, since it would be hidden in its own dent.
    axes.plot([tip[0], tip[0] + 70.0], [tip[1]] * 2, [tip[2]] * 2, color=STYLUS, zorder=20)
    axes.plot([tip[0]], [tip[1]], [tip[2]], "o", color=STYLUS, markersize=4, zorder=21)
    size = 1e3 * float(np.abs(mesh.vertices).max())
    axes.set_xlim(-size, size)
    axes.set_ylim(-size, size)
    axes.set_zlim(-size, size)
    axes.set_box_aspect((1, 1, 1), zoom=1.45)  # pyright: ignore[reportArgumentType]
    axes.view_init(*_VIEW)
    axes.computed_zorder = False
    axes.set_axis_off()
