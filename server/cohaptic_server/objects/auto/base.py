"""The part of an object that is held if nobody says which: its own base, or its flattest side."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cohaptic_server.mesh.surface import face_area_vectors
from cohaptic_server.numeric import Floats, Ints

# Files of these kinds have y upwards by their specification or by custom, all others z.
_Y_UP = (".glb", ".gltf", ".obj")
_LAYER = 0.01  # share of the extent; faces this close to a side belong to it
_FACING = 0.99  # cosine of the largest angle between a side and a face that rests on it
# Share of the bounding box's side that a flat base has: with less, a body stands on feet.
_FLAT = 0.15
# With at least this share below it, an object stands on feet, and a table is not held by its top. A
# ball, which stands on nothing, has 0.015.
_STANDS = 0.025
# Least share of the surface that is held: with less, a body sways on its hold like a bell.
_LEAST_HELD = 0.04
_PERCENTAGES = (3, 5, 8, 10, 15, 20, 25, 30)
# Share of the surface above which a base is no hold: what lies flat on it has nowhere to give way.
_MOST_HELD = 0.3


class Side(NamedTuple):
    """One side of the bounding box.

    Args:
        axis: 0, 1 or 2.
        sign: -1 for the lower side.
    """

    axis: int
    sign: int


def likely_base(x: Floats, faces: Ints, kind: str) -> tuple[str, str]:
    """A rule for `--fix` that holds an object where it would stand, and words for it.

    Args:
        x: Vertices, shape (n, 3), in any unit.
        faces: Triangles facing outwards, shape (m, 3).
        kind: Suffix of the file, in small letters.
    """
    down = Side(1 if kind in _Y_UP else 2, -1)
    flat = {side: flat_share(x, faces, side) for side in _sides()}
    chosen, words = down, "its lowest part is held"
    flattest = max(flat, key=lambda side: flat[side])
    if flat[down] >= _FLAT:
        words = "its base is held"
    elif flat[down] >= _STANDS:
        words = "its feet are held"
    elif flat[flattest] >= _FLAT:
        chosen, words = flattest, "its flattest side is held"
    rule, held = _rule(x, faces, chosen)
    if held > _MOST_HELD:
        longest = int(np.ptp(x, axis=0).argmax())
        chosen, words = Side(longest, -1), "it lies flat, so one end of it is held"
        rule, _ = _rule(x, faces, chosen)
    return rule, words


def flat_share(x: Floats, faces: Ints, side: Side) -> float:
    """Area of the faces that lie on a side of the bounding box, as a share of that side's area."""
    areas = face_area_vectors(x, faces)
    outwards = side.sign * areas[:, side.axis]
    length = np.linalg.norm(areas, axis=1)
    resting = (_away(x, faces, side) <= _LAYER) & (outwards > _FACING * length)
    width, depth = (np.ptp(x[:, axis]) for axis in range(3) if axis != side.axis)
    return float(outwards[resting].sum() / max(float(width * depth), 1e-300))


def _away(x: Floats, faces: Ints, side: Side) -> Floats:
    """Distance of each face's middle from a side, as a share of the extent, shape (m,)."""
    along = x[:, side.axis]
    share = (x[faces].mean(axis=1)[:, side.axis] - along.min()) / max(np.ptp(along), 1e-300)
    return np.asarray(share if side.sign < 0 else 1.0 - share)


def _sides() -> list[Side]:
    return [Side(axis, sign) for axis in (2, 1, 0) for sign in (-1, 1)]


def _rule(x: Floats, faces: Ints, side: Side) -> tuple[str, float]:
    """The thinnest layer at a side with enough of the surface in it: a rule, and its share."""
    areas = np.linalg.norm(face_area_vectors(x, faces), axis=1)
    away = _away(x, faces, side)
    shares = {p: float(areas[away < 0.01 * p].sum() / areas.sum()) for p in _PERCENTAGES}
    enough = (p for p, share in shares.items() if share >= _LEAST_HELD)
    percentage = next(enough, _PERCENTAGES[-1])
    name = "xyz"[side.axis]
    rule = f"{name} < {percentage}%" if side.sign < 0 else f"{name} > {100 - percentage}%"
    return rule, shares[percentage]
