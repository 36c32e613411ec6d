"""Draws four views of an object, coloured by its stiffness K_o, with the fixed part in grey.

A surface that holds the object is drawn over it, translucent and with its outline, wherever it
lies: a surface of a wrong unit or with mirrored axes is seen. Where the axes are those of a
patient, each view has a small cross with letters: R and L for right and left, A and P for anterior
and posterior, S and I for superior and inferior.
"""

# pyright: reportUnknownMemberType=false, reportMissingTypeStubs=false

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from cohaptic.errors import BodyError
from cohaptic.runtime.new_file import write_new
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
# Letters at the positive and the negative end of x, y and z in the axes of a patient.
LETTERS = {
    "ras": (("R", "L"), ("A", "P"), ("S", "I")),
    "lps": (("L", "R"), ("P", "A"), ("S", "I")),
}
_LIGHT = np.array([-0.45, 0.65, 0.62])  # direction of the light: right, up, towards the eye
_FIXED_COLOR = (0.80, 0.80, 0.79)
_SURFACE_COLOR = "#D55E00"  # of the surface that holds; neither the colour scale nor grey has it
_SURFACE_ALPHA = 0.28
_PIXELS = 640  # width of the image that a surface's outline is taken from
_INK, _DIM = "#1F2937", "#6B7280"
_TALL = 0.72  # height of a view over its width
_MARGIN = 1.03  # half-width of a view over the half-width of the object
_FINE = 40_000  # triangles; a coarser surface is subdivided for smooth shading
_ENDS = (2.0, 98.0)  # percentiles of the stiffness at the ends of the colour scale
# Largest half-width of a view over that of the object. What of a surface lies beyond is cut off,
# since a large one would leave a dot of the object.
_MAX_BESIDE = 1.6
_ARM = 0.11  # length of the arms of a cross with letters, as a share of a view's half-width
_LEAST_ARM = 0.5  # of its full length; a shorter arm points at the eye, and has no letters


def draw(
    path: Path,
    mesh: SurfaceMesh,
    stiffness: Floats,
    fixed: npt.NDArray[np.bool_],
    *,
    title: str,
    notes: str,
    holding: tuple[Floats, Ints] | None = None,
    axes_of_file: str = "",
    overwrite: bool = False,
) -> None:
    """Draw the stiffness of a surface to a PNG file.

    Args:
        path: Path of the PNG file.
        mesh: Surface of the object.
        stiffness: Stiffness K_o of the object at each of the n vertices, shape (n,) [N/m].
        fixed: Whether each vertex is fixed, shape (n,).
        title: Title of the picture.
        notes: A line under the title.
        holding: Vertices, shape (m, 3) [m] in the frame of `mesh`, and triangles, shape (f, 3), of
            the surface that holds the object; None if there is none.
        axes_of_file: Axes of a patient that the mesh has, `ras` or `lps`; empty for none.
        overwrite: Whether to replace a file of that name.

    Raises:
        BodyError: matplotlib is not installed.
        OutputError: The file cannot be written.
    """
    try:
        from matplotlib import colormaps
        from matplotlib.colors import LogNorm
        from matplotlib.figure import Figure
    except ImportError as error:
        raise BodyError(
            f"{path}: a picture needs matplotlib; install it with: pip install 'cohaptic[objects]'"
        ) from error
    low, high = np.percentile(stiffness[~fixed], _ENDS)
    norm = LogNorm(low, max(high, 1.05 * low), clip=True)
    fractions = np.asarray(norm(np.where(fixed, high, stiffness)), dtype=np.float64)
    colors: Floats = np.array(colormaps["viridis"](fractions), dtype=np.float64)[:, :3]
    colors[fixed] = _FIXED_COLOR
    x, faces, normals, colors = _subdivided(mesh, colors)
    figure = Figure(figsize=(10.0, 7.4), facecolor="white")
    _views(figure, (x, faces, normals, colors), holding, LETTERS.get(axes_of_file, ()))
    _legend(figure, norm, with_surface=holding is not None)
    figure.text(
        0.03, 0.955, title, fontsize=14, color=_INK, weight="bold", va="center", parse_math=False
    )
    figure.text(0.03, 0.915, notes, fontsize=9, color=_DIM, va="center", parse_math=False)
    write_new(path, lambda file: figure.savefig(file, format="png", dpi=160), overwrite=overwrite)


def _views(
    figure: Figure,
    drawn: tuple[Floats, Ints, Floats, Floats],
    holding: tuple[Floats, Ints] | None,
    letters: tuple[tuple[str, str], ...],
) -> None:
    """Draw all views of an object, and of the surface that holds it, in one scale.

    Args:
        drawn: Vertices, triangles, normals and colours of the object from `_subdivided`.
        holding: Vertices and triangles of the surface; None if there is none.
        letters: Letters at the ends of x, y and z; empty for none.
    """
    x, faces, normals, colors = drawn
    middle = 0.5 * (x.min(axis=0) + x.max(axis=0))
    size = _half_width(x - middle)
    if holding is not None:
        size = max(size, min(_half_width(holding[0] - middle), _MAX_BESIDE * size))
    size *= _MARGIN
    for k, (name, azimuth, elevation) in enumerate(_VIEWS):
        axes = figure.add_axes((0.01 + 0.43 * (k % 2), 0.465 - 0.415 * (k // 2), 0.42, 0.41))
        frame = _frame(azimuth, elevation)
        _view(axes, (x - middle) @ frame.T, faces, normals @ frame.T, colors)
        if holding is not None:
            _outline(axes, (holding[0] - middle) @ frame.T, holding[1], size)
        axes.set_xlim(-size, size)
        axes.set_ylim(-_TALL * size, _TALL * size)
        if letters:
            _cross(axes, frame, size, letters)
            name = _from_side(name, frame, letters)
        axes.text(0.02, 0.96, name, transform=axes.transAxes, color=_DIM, fontsize=9, va="top")
        if k == 2:
            _scale_bar(axes, size)


def _legend(figure: Figure, norm: LogNorm, *, with_surface: bool) -> None:
    """Draw the colour scale, and the colours of what is held and of the surface that holds it."""
    from matplotlib.cm import ScalarMappable

    scale = figure.add_axes((0.895, 0.16, 0.018, 0.6))
    bar = figure.colorbar(ScalarMappable(norm, "viridis"), cax=scale, extend="both")
    _ticks(bar.ax, norm)
    bar.outline.set_visible(False)  # pyright: ignore[reportCallIssue]
    scale.set_title("K$_o$ [N/m]", fontsize=10, color=_INK, pad=12, loc="left")
    figure.add_artist(_swatch(figure, 0.075, _FIXED_COLOR))
    figure.text(0.924, 0.085, "held", fontsize=9, color=_INK, va="center")
    if with_surface:
        figure.add_artist(_swatch(figure, 0.035, _SURFACE_COLOR))
        figure.text(0.924, 0.045, "fix-mesh", fontsize=9, color=_INK, va="center")


def _swatch(figure: Figure, bottom: float, color: Any) -> Artist:
    """Return a rectangle below the colour scale that explains a colour."""
    from matplotlib.patches import Rectangle

    return Rectangle((0.895, bottom), 0.018, 0.02, transform=figure.transFigure, color=color)


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


def _view(axes: Axes, seen: Floats, faces: Ints, n: Floats, colors: Floats) -> None:
    """Draw the triangles that face the eye, the nearest last, in orthographic projection.

    Args:
        seen: Vertices in the axes of the view: right, up, towards the eye, shape (n, 3) [m].
        n: Unit normals at the vertices in these axes, shape (n, 3).
    """
    from matplotlib.collections import TriMesh
    from matplotlib.tri import Triangulation

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


def _outline(axes: Axes, seen: Floats, faces: Ints, size: float) -> None:
    """Draw a closed surface over what is there: its inside translucent, and its outline.

    The outline is that of an image of the inside: edges between triangles that face the eye and
    others would be lines all over a rough surface.

    Args:
        seen: Vertices in the axes of the view, shape (n, 3) [m].
        size: Half-width of the view [m].
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
    from matplotlib.patches import PathPatch
    from matplotlib.path import Path as Outline

    corners = seen[faces][:, :, :2]
    (ax, ay), (bx, by) = ((corners[:, k] - corners[:, 0]).T for k in (1, 2))
    facing = ax * by > ay * bx
    # One path of all triangles is filled once where they overlap, and without seams.
    closed = corners[facing][:, [0, 1, 2, 0]].reshape(-1, 2)
    codes = [Outline.MOVETO, Outline.LINETO, Outline.LINETO, Outline.CLOSEPOLY]
    whole = Outline(closed, np.tile(codes, int(facing.sum())))
    axes.add_patch(PathPatch(whole, color=_SURFACE_COLOR, alpha=_SURFACE_ALPHA, linewidth=0))
    canvas: Any = FigureCanvasAgg(Figure(figsize=(1.0, _TALL), dpi=_PIXELS))
    across, up = (-size, size), (-_TALL * size, _TALL * size)
    image = canvas.figure.add_axes((0.0, 0.0, 1.0, 1.0), xlim=across, ylim=up)
    image.set_axis_off()
    image.add_patch(PathPatch(whole, color="black", linewidth=0))
    canvas.draw()
    covered = np.asarray(canvas.buffer_rgba())[::-1, :, 0] < 128
    if covered.any() and not covered.all():
        x, y = np.linspace(*across, covered.shape[1]), np.linspace(*up, covered.shape[0])
        for color, width in (("white", 3.2), (_SURFACE_COLOR, 1.6)):
            axes.contour(x, y, covered, [0.5], colors=color, linewidths=width)


def _cross(axes: Axes, frame: Floats, size: float, letters: tuple[tuple[str, str], ...]) -> None:
    """Draw the axes of a patient into the upper right corner of a view, with letters at the ends.

    Args:
        frame: Axes of the view from `_frame`.
        size: Half-width of the view [m].
        letters: Letters at the positive and the negative end of x, y and z.
    """
    from matplotlib.patheffects import withStroke

    centre = size * np.array([0.85, 0.76 * _TALL])
    halo = [withStroke(linewidth=2.5, foreground="white")]
    for axis, ends in enumerate(letters):
        arm = frame[:2, axis]
        length = float(np.linalg.norm(arm))
        if length < _LEAST_ARM:
            continue
        tips = centre + _ARM * size * np.array([arm, -arm])
        axes.plot(tips[:, 0], tips[:, 1], color=_DIM, lw=0.9, path_effects=halo)
        for letter, tip in zip(ends, tips, strict=True):
            x, y = tip + 0.4 * _ARM * (tip - centre) / (_ARM * length)
            axes.text(
                x, y, letter, color=_INK, fontsize=8, ha="center", va="center", path_effects=halo
            )


def _from_side(name: str, frame: Floats, letters: tuple[tuple[str, str], ...]) -> str:
    """Name of a view in the axes of a patient, whose front is where A is."""
    if name in ("above", "below"):
        return f"from {name}"
    eye_y = frame[2, 1] if letters[1][0] == "A" else -frame[2, 1]
    return "from the front" if eye_y > 0.0 else "from behind"


def _frame(azimuth: float, elevation: float) -> Floats:
    """Return the unit vectors of a view as rows: right, up, towards the eye; angles in degrees."""
    a, e = np.radians([azimuth, elevation])
    eye = np.array([np.cos(a) * np.cos(e), np.sin(a) * np.cos(e), np.sin(e)])
    right = np.array([-np.sin(a), np.cos(a), 0.0])
    return np.stack([right, np.cross(eye, right), eye])


def _half_width(x: Floats) -> float:
    """Return half of the width that all views need to show points about the origin [m]."""
    each = (
        np.abs(x @ _frame(azimuth, elevation).T).max(axis=0) for _, azimuth, elevation in _VIEWS
    )
    return max(float(max(right, up / _TALL)) for right, up, _ in each)


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
