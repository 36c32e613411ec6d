"""What a second surface holds of an object: `--fix-mesh bone.stl`.

A point is inside where the surface winds round it: the solid angles that its triangles take up,
with their signs, sum to a whole turn (Van Oosterom, Strackee 1983). Inside out is inside too.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt

from cohaptic.errors import BodyError, SettingError
from cohaptic_server.numeric import Floats, Ints
from cohaptic_server.objects.surface.checks import edge_counts
from cohaptic_server.objects.surface.surface_file import read_surface

MOST = 100_000  # triangles; a rough one does
_AT_ONCE = 2**21  # pairs of a point and a triangle


def held_within(path: Path, scale: float, x: Floats) -> npt.NDArray[np.bool_]:
    """Which places lie inside the closed surface of a file, shape (n,).

    Args:
        path: Of the surface.
        scale: Metres in one unit of the file.
        x: Shape (n, 3) [m].

    Raises:
        BodyError: There is no closed surface in the file.
        SettingError: Nothing lies inside it, or everything.
    """
    if not path.is_file():
        raise BodyError(f"{path}: there is no such file")
    y, faces = read_surface(path)
    y = y * scale
    if len(faces) > MOST:
        raise BodyError(f"{path}: {len(faces):,} triangles; to say what is held {MOST:,} must do")
    counts = edge_counts(faces)
    if (counts != 2).any():
        raise BodyError(
            f"{path}: the surface that holds is not closed: {(counts != 2).sum()} of its edges do"
            " not have two triangles"
        )
    held = inside(y, faces, x)
    if not held.any():
        what = f"a surface with some of the object in it, or it would float away; {_box(y)}"
        raise SettingError("--fix-mesh", str(path), f"{what}, the object {_box(x)}")
    if held.all():
        raise SettingError("--fix-mesh", str(path), "one that leaves something free to move")
    return held


def inside(y: Floats, faces: Ints, x: Floats) -> npt.NDArray[np.bool_]:
    """Which points are inside a closed surface, shape (n,).

    Args:
        y: Vertices of the surface, shape (m, 3).
        faces: Its triangles, shape (f, 3).
        x: Points, shape (n, 3).
    """
    found = np.zeros(len(x), dtype=np.bool_)
    boxed = np.flatnonzero(((x >= y.min(axis=0)) & (x <= y.max(axis=0))).all(axis=1))
    step = max(1, _AT_ONCE // len(faces))
    for start in range(0, len(boxed), step):
        points = boxed[start : start + step]
        a, b, c = (y[faces[:, k]][None] - x[points][:, None] for k in range(3))
        la, lb, lc = (np.sqrt(np.einsum("pfi,pfi->pf", v, v)) for v in (a, b, c))
        volume = np.einsum("pfi,pfi->pf", a, np.cross(b, c))
        flat = (
            la * lb * lc
            + np.einsum("pfi,pfi->pf", a, b) * lc
            + np.einsum("pfi,pfi->pf", b, c) * la
            + np.einsum("pfi,pfi->pf", c, a) * lb
        )
        turns = np.arctan2(volume, flat).sum(axis=1) / (2.0 * np.pi)
        found[points] = np.abs(turns) > 0.5
    return found


def _box(x: Floats) -> str:
    low, high = x.min(axis=0), x.max(axis=0)
    ranges = ", ".join(f"{a} {low[k]:.3g} to {high[k]:.3g} m" for k, a in enumerate("xyz"))
    return f"it has {ranges}"
