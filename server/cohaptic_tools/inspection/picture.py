"""Draws four views of an object, coloured by its stiffness K_o, with the fixed part in grey."""

# pyright: reportUnknownMemberType=false, reportMissingTypeStubs=false

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from cohaptic.errors import BodyError
from cohaptic_server.mesh.surface import SurfaceMesh
from cohaptic_server.numeric import Floats, Ints

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.colors import LogNorm
    from matplotlib.figure import Figure

# Azimuth and elevation of the eye [degrees]; most objects are fixed at the bottom.
_VIEWS = (
    ("front", -65.0, 22.0),
    ("back", 115.0, 22.0),
    ("above", -90.0, 88.0),
    ("below", -90.0, -62.0),
)
_LIGHT = np.array([-0.45, 0.65, 0.62])  # direction of the light: right, up, towards the eye
_FIXED_COLOR = (0.80, 0.80, 0.79)
_INK, _DIM = "#1F2937", "#6B7280"
_TALL = 0.72  # height of a view over its width
_MARGIN = 1.03  # half-width of a view over the half-width of the object
_FINE = 40_000  # triangles; a coarser surface is subdivided for smooth shading
_ENDS = (2.0, 98.0)  # percentiles of the stiffness at the ends of the colour scale


def draw(
    path: Path,
    mesh: SurfaceMesh,
    stiffness: Floats,
    fixed: npt.NDArray[np.bool_],
    *,
    title: str,
    notes: str,
) -> None:
    """Draw the stiffness of a surface to a PNG file.

    Args:
        path: Path of the PNG file.
        mesh: Surface of the object.
        stiffness: Stiffness K_o of the object at each of the n vertices, shape (n,) [N/m].
        fixed: Whether each vertex is fixed, shape (n,).
        title: Title of the picture.
        notes: A line under the title.

    Raises:
        BodyError: matplotlib is not installed, or the file cannot be written.
    """
    try:
        from matplotlib import colormaps
        from matplotlib.cm import ScalarMappable
        from matplotlib.colors import LogNorm
        from matplotlib.figure import Figure
    except ImportError as error:
        raise BodyError(
            f"{path}: a picture needs matplotlib; install it with: pip install 'cohaptic[objects]'"
        ) from error
    low, high = np.percentile(stiffness[~fixed], _ENDS)
    norm = LogNorm(low, max(high, 1.05 * low), clip=True)
    shares = np.asarray(norm(np.where(fixed, high, stiffness)), dtype=np.float64)
    colors: Floats = np.array(colormaps["viridis"](shares), dtype=np.float64)[:, :3]
    colors[fixed] = _FIXED_COLOR
    x, faces, normals, colors = _subdivided(mesh, colors)
    figure = Figure(figsize=(10.0, 7.4), facecolor="white")
    size = _MARGIN * max(_half_width(x, azimuth, elevation) for _, azimuth, elevation in _VIEWS)
    for k, (name, azimuth, elevation) in enumerate(_VIEWS):
        axes = figure.add_axes((0.01 + 0.43 * (k % 2), 0.465 - 0.415 * (k // 2), 0.42, 0.41))
        _view(axes, x, faces, normals, colors, azimuth, elevation)
        axes.set_xlim(-size, size)
        axes.set_ylim(-_TALL * size, _TALL * size)
        axes.text(0.02, 0.96, name, transform=axes.transAxes, color=_DIM, fontsize=9, va="top")
        if k == 2:
            _scale_bar(axes, size)
    scale = figure.add_axes((0.895, 0.16, 0.018, 0.6))
    bar = figure.colorbar(ScalarMappable(norm, "viridis"), cax=scale, extend="both")
    _ticks(bar.ax, norm)
    bar.outline.set_visible(False)  # pyright: ignore[reportCallIssue]
    scale.set_title("K$_o$ [N/m]", fontsize=10, color=_INK, pad=12, loc="left")
    figure.add_artist(_swatch(figure))
    figure.text(0.924, 0.085, "held", fontsize=9, color=_INK, va="center")
    figure.text(0.03, 0.955, title, fontsize=14, color=_INK, weight="bold", va="center")
    figure.text(0.03, 0.915, notes, fontsize=9, color=_DIM, va="center")
    try:
        figure.savefig(path, dpi=160)
    except (OSError, ValueError) as error:
        raise BodyError(f"{path}: the picture cannot be written ({error})") from error


def _swatch(figure: Figure) -> Artist:
    """Return the rectangle beside the colour scale that explains the grey of the fixed part."""
    from matplotlib.patches import Rectangle

    return Rectangle((0.895, 0.075), 0.018, 0.02, transform=figure.transFigure, color=_FIXED_COLOR)


def _ticks(axes: Axes, norm: LogNorm) -> None:
    """Label the colour scale with round numbers, since powers of ten alone would be too few."""
    low, high = float(norm.vmin or 1.0), float(norm.vmax or 1.0)
    rounds = [m * 10.0**e for e in range(-3, 10) for m in (1, 1.5, 2, 3, 4, 5, 7)]
    inside = [r for r in rounds if low * 0.999 <= r <= high * 1.001] or [low, high]
    axes.set_yticks(inside, [f"{r:g}" for r in inside], color=_INK, fontsize=9)
    axes.set_yticks([], minor=True)
    axes.tick_params(length=0)


def _scale_bar(axes: Axes, size: float) -> None:
    """Draw a bar of a round length, with its label, into a view of half-width `size` [m]."""
    rounds = [m * 10.0**e for e in range(-4, 2) for m in (1, 2, 5)]
    length = max(r for r in rounds if r <= 0.6 * size)
    y = -0.92 * _TALL * size
    axes.plot(
        [-0.95 * size, -0.95 * size + length], [y, y], color=_INK, lw=2, solid_capstyle="butt"
    )
    label = f"{1e3 * length:g} mm" if length < 1.0 else f"{length:g} m"
    axes.text(-0.95 * size, y + 0.03 * size, label, fontsize=8, color=_INK, va="bottom")


def _view(
    axes: Axes,
    x: Floats,
    faces: Ints,
    normals: Floats,
    colors: Floats,
    azimuth: float,
    elevation: float,
) -> None:
    """Draw the triangles that face the eye, the nearest last, in orthographic projection."""
    from matplotlib.collections import TriMesh
    from matplotlib.tri import Triangulation

    frame = _frame(azimuth, elevation)
    seen = _seen(x, frame)
    n = normals @ frame.T
    depth = seen[faces, 2].mean(axis=1)
    # A triangle at the outline has corners that face the eye and corners that do not.
    facing = np.flatnonzero((n[faces, 2] > -0.05).any(axis=1))
    order = facing[np.argsort(depth[facing])]
    light = _LIGHT / np.linalg.norm(_LIGHT)
    diffuse = np.clip(n @ light, 0.0, 1.0)
    half = light + np.array([0.0, 0.0, 1.0])
    shine = np.clip(n @ (half / np.linalg.norm(half)), 0.0, 1.0) ** 40
    rim = np.clip(n[:, 2], 0.0, 1.0) ** 0.5
    shade = (0.55 + 0.5 * diffuse) * (0.78 + 0.22 * rim)
    lit = np.clip(colors * shade[:, None] + 0.16 * shine[:, None], 0.0, 1.0)
    picture = TriMesh(Triangulation(seen[:, 0], seen[:, 1], faces[order]))
    colors_of: Any = picture.set_facecolor  # typed for one colour; an array has one for each vertex
    colors_of(np.column_stack([lit, np.ones(len(lit))]))
    axes.add_collection(picture)
    axes.set_aspect("equal")
    axes.set_axis_off()


def _frame(azimuth: float, elevation: float) -> Floats:
    """Return the unit vectors of a view as rows: right, up, towards the eye; angles in degrees."""
    a, e = np.radians([azimuth, elevation])
    eye = np.array([np.cos(a) * np.cos(e), np.sin(a) * np.cos(e), np.sin(e)])
    right = np.array([-np.sin(a), np.cos(a), 0.0])
    return np.stack([right, np.cross(eye, right), eye])


def _seen(x: Floats, frame: Floats) -> Floats:
    """Return points in the axes of a view, from the middle of their bounding box, (n, 3) [m]."""
    return np.asarray((x - 0.5 * (x.min(axis=0) + x.max(axis=0))) @ frame.T)


def _half_width(x: Floats, azimuth: float, elevation: float) -> float:
    """Return half of the width that a view needs to show all points [m]."""
    right, up, _ = np.abs(_seen(x, _frame(azimuth, elevation))).max(axis=0)
    return float(max(right, up / _TALL))


def _subdivided(mesh: SurfaceMesh, colors: Floats) -> tuple[Floats, Ints, Floats, Floats]:
    """Divide each triangle into four until the surface has about `_FINE` triangles.

    Returns:
        Vertices (n, 3) [m], triangles (m, 3), unit normals (n, 3) and colours (n, 3).
    """
    x, faces, n = mesh.vertices, mesh.faces, mesh.normals
    while 4 * len(faces) <= _FINE:
        pairs = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
        edges, inverse = np.unique(pairs, axis=0, return_inverse=True)
        (a, b, c), (ab, bc, ca) = faces.T, (len(x) + inverse.reshape(-1, 3)).T
        quarters = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
        faces = np.concatenate([np.stack(quarter, axis=1) for quarter in quarters])
        midpoint_normals = n[edges].sum(axis=1)
        midpoint_normals /= np.linalg.norm(midpoint_normals, axis=1, keepdims=True)
        x = np.concatenate([x, x[edges].mean(axis=1)])
        n, colors = (
            np.concatenate([n, midpoint_normals]),
            np.concatenate([colors, colors[edges].mean(axis=1)]),
        )
    return x, faces, n, colors
