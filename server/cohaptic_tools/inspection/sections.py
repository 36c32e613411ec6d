"""Draws the parts of an object: three sections through the object, with a colour for each part."""

# pyright: reportUnknownMemberType=false, reportMissingTypeStubs=false

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from cohaptic.errors import BodyError
from cohaptic.runtime.new_file import write_new
from cohaptic_server.mesh.tetrahedra import EDGES, TetMesh, volumes
from cohaptic_server.numeric import Floats, Ints
from cohaptic_server.objects.parts.parts import Parts
from cohaptic_tools.inspection.picture import LETTERS

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_INK, _DIM = "#1F2937", "#6B7280"
# Okabe and Ito's colours, which colour-blind people can tell apart, too; further parts repeat them.
_COLORS = ("#C9D6DF", "#E69F00", "#0072B2", "#CC79A7", "#009E73", "#D55E00", "#56B4E9", "#F0E442")
_LISTED = 12  # parts in the legend


def draw_sections(
    path: Path,
    tets: TetMesh,
    parts: Parts,
    words: list[str],
    *,
    title: str,
    axes_of_file: str = "",
    overwrite: bool = False,
) -> None:
    """Draw sections normal to x, y and z, each through the middle of a small part, to a PNG file.

    Args:
        path: Path of the PNG file.
        tets: Tetrahedra of the object.
        parts: Parts of these tetrahedra.
        words: Texts of the legend, one for each part.
        title: Title of the picture.
        axes_of_file: Axes of a patient that the mesh has, `ras` or `lps`; empty for none.
        overwrite: Whether to replace a file of that name.

    Raises:
        BodyError: matplotlib is not installed.
        OutputError: The file cannot be written.
    """
    try:
        from matplotlib.collections import PolyCollection
        from matplotlib.figure import Figure
        from matplotlib.patches import Patch
    except ImportError as error:
        raise BodyError(
            f"{path}: a picture needs matplotlib; install it with: pip install 'cohaptic[objects]'"
        ) from error
    sizes = parts.volumes(tets)
    # Colours are assigned by size, so that the largest part has the pale first colour.
    order: list[int] = np.argsort(-sizes, kind="stable").tolist()
    colors = [_COLORS[order.index(k) % len(_COLORS)] for k in range(len(order))]
    within = order[:0:-1] or order  # parts to be cut: all but the largest, the smallest first
    middles = [_middle(tets, parts.of == within[k % len(within)]) for k in range(3)]
    figure = Figure(figsize=(10.0, 4.6), facecolor="white")
    names = _axis_names(axes_of_file)
    low, high = 1e3 * tets.vertices.min(axis=0), 1e3 * tets.vertices.max(axis=0)
    for k, (axis, middle) in enumerate(zip((1, 0, 2), middles, strict=True)):
        axes = figure.add_axes((0.06 + 0.32 * k, 0.24, 0.26, 0.58))
        across, up = [other for other in range(3) if other != axis]
        polygons, owners = section(tets, axis, float(middle[axis]))
        shown = [1e3 * polygon[:, [across, up]] for polygon in polygons]
        fill = [colors[int(part)] for part in parts.of[owners]]
        axes.add_collection(PolyCollection(shown, facecolors=fill, edgecolors=fill, linewidths=0.3))
        axes.set(xlim=(low[across], high[across]), ylim=(low[up], high[up]))
        axes.margins(0.05)
        axes.set_aspect("equal")
        axes.set_xlabel(names[across], fontsize=9, color=_INK)
        axes.set_ylabel(names[up], fontsize=9, color=_INK, labelpad=1)
        axes.tick_params(labelsize=8, colors=_DIM)
        axes.set_title(f"{'xyz'[axis]} = {1e3 * middle[axis]:.1f} mm", fontsize=9, color=_DIM)
        axes.spines[:].set_visible(False)
    handles = [Patch(color=colors[k], label=words[k].replace("$", r"\$")) for k in order[:_LISTED]]
    figure.legend(handles=handles, loc="lower center", ncols=3, frameon=False, fontsize=9)
    _save(figure, path, title, overwrite=overwrite)


def _save(figure: Figure, path: Path, title: str, *, overwrite: bool) -> None:
    """Write a title over a figure, and the figure to a PNG file.

    Raises:
        OutputError: The file cannot be written.
    """
    figure.text(
        0.03, 0.93, title, fontsize=14, color=_INK, weight="bold", va="center", parse_math=False
    )
    write_new(path, lambda file: figure.savefig(file, format="png", dpi=160), overwrite=overwrite)


def _axis_names(axes_of_file: str) -> list[str]:
    """Names of x, y and z; in the axes of a patient with the directions that they lead to."""
    ends = LETTERS.get(axes_of_file)
    reported = [""] * 3 if ends is None else [f", {start} to {end}" for end, start in ends]
    return [f"{name} [mm]{words}" for name, words in zip("xyz", reported, strict=True)]


def section(tets: TetMesh, axis: int, at: float) -> tuple[list[Floats], Ints]:
    """Cut tetrahedra with a plane; return a polygon for each tetrahedron that the plane cuts.

    Args:
        tets: Tetrahedra of the object.
        axis: Axis normal to the plane: 0, 1 or 2.
        at: Coordinate of the plane along this axis [m].

    Returns:
        Corners of each of the k polygons, shape (3 or 4, 3) [m], in order round the polygon;
        indices of the tetrahedra, shape (k,).
    """
    x = tets.vertices
    above = (x[:, axis] > at)[tets.tets]
    crossed = np.flatnonzero(above.any(axis=1) & ~above.all(axis=1))
    others = [other for other in range(3) if other != axis]
    polygons: list[Floats] = []
    for index in crossed.tolist():
        corners, sides = x[tets.tets[index]], above[index]
        points: list[Floats] = []
        for a, b in EDGES:
            if sides[a] != sides[b]:
                fraction = (at - corners[a, axis]) / (corners[b, axis] - corners[a, axis])
                points.append(corners[a] + fraction * (corners[b] - corners[a]))
        polygon = np.array(points)
        off = (polygon - polygon.mean(axis=0))[:, others]
        polygons.append(polygon[np.argsort(np.arctan2(off[:, 1], off[:, 0]))])
    return polygons, crossed


def _middle(tets: TetMesh, chosen: np.ndarray[tuple[int], np.dtype[np.bool_]]) -> Floats:
    """Return the centre of volume of the tetrahedra in the mask `chosen`, shape (3,) [m]."""
    t = tets.tets[chosen]
    weights = volumes(tets.vertices, t)
    return np.asarray(weights @ tets.vertices[t].mean(axis=1) / weights.sum())
