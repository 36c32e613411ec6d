"""Selects the fixed vertices of an object by a closed surface: `--fix-mesh bone.stl`.

A point is inside the surface if its winding number is not zero. This number is the sum of the
triangles' signed solid angles, seen from the point, over 4 pi (Van Oosterom, Strackee 1983). The
test also works for a surface that is inside out.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt

from cohaptic.errors import BodyError, SettingError
from cohaptic_server.numeric import Floats, Ints
from cohaptic_server.objects.surface.checks import edge_counts
from cohaptic_server.objects.surface.surface_file import read_surface

MAX_FIX_TRIANGLES = 100_000  # a rough surface is enough to select vertices
_PAIRS_PER_BLOCK = 2**21  # pairs of a point and a triangle; one array of vectors takes 50 MB


def fixed_within(path: Path, y: Floats, faces: Ints, x: Floats) -> npt.NDArray[np.bool_]:
    """Whether each vertex lies inside the closed surface of a file, shape (n,).

    Args:
        path: File of the surface, for the error.
        y: Vertices of the surface from `read_fix_mesh`, shape (m, 3) [m].
        faces: Triangles of the surface, shape (f, 3).
        x: Vertices of the object, shape (n, 3) [m].

    Raises:
        SettingError: No vertex lies inside the surface, or all of them do.
    """
    fixed = inside(y, faces, x)
    if not fixed.any():
        expected = f"a surface with some of the object in it, or it would float away; {_box(y)}"
        raise SettingError("--fix-mesh", str(path), f"{expected}, the object {_box(x)}")
    if fixed.all():
        raise SettingError("--fix-mesh", str(path), "one that leaves something free to move")
    return fixed


def read_fix_mesh(path: Path, scale: float) -> tuple[Floats, Ints]:
    """Read the closed surface of a file: vertices, shape (m, 3) [m], and triangles, shape (f, 3).

    Args:
        scale: Metres in one unit of the file.

    Raises:
        BodyError: The file has no closed surface, or too many triangles.
    """
    if not path.is_file():
        raise BodyError(f"{path}: there is no such file")
    y, faces = read_surface(path)
    if len(faces) > MAX_FIX_TRIANGLES:
        raise BodyError(
            f"{path}: {len(faces):,} triangles; to say what is held {MAX_FIX_TRIANGLES:,} must do"
        )
    counts = edge_counts(faces)
    if (counts != 2).any():
        raise BodyError(
            f"{path}: the surface that holds is not closed: {(counts != 2).sum()} of its edges do"
            " not have two triangles"
        )
    return y * scale, faces


def inside(y: Floats, faces: Ints, x: Floats) -> npt.NDArray[np.bool_]:
    """Whether each point is inside a closed surface, shape (n,).

    Args:
        y: Vertices of the surface, shape (m, 3).
        faces: Triangles of the surface, shape (f, 3).
        x: Points, shape (n, 3).
    """
    is_inside = np.zeros(len(x), dtype=np.bool_)
    in_box = np.flatnonzero(((x >= y.min(axis=0)) & (x <= y.max(axis=0))).all(axis=1))
    step = max(1, _PAIRS_PER_BLOCK // len(faces))
    for start in range(0, len(in_box), step):
        points = in_box[start : start + step]
        a, b, c = (y[faces[:, k]][None] - x[points][:, None] for k in range(3))
        la, lb, lc = (np.sqrt(np.einsum("pfi,pfi->pf", v, v)) for v in (a, b, c))
        numerator = np.einsum("pfi,pfi->pf", a, np.cross(b, c))
        denominator = (
            la * lb * lc
            + np.einsum("pfi,pfi->pf", a, b) * lc
            + np.einsum("pfi,pfi->pf", b, c) * la
            + np.einsum("pfi,pfi->pf", c, a) * lb
        )
        # The arctangent is half of a triangle's solid angle, and a whole turn is 4 pi.
        winding = np.arctan2(numerator, denominator).sum(axis=1) / (2.0 * np.pi)
        is_inside[points] = np.abs(winding) > 0.5
    return is_inside


def _box(x: Floats) -> str:
    low, high = x.min(axis=0), x.max(axis=0)
    ranges = ", ".join(f"{a} {low[k]:.3g} to {high[k]:.3g} m" for k, a in enumerate("xyz"))
    return f"it has {ranges}"
