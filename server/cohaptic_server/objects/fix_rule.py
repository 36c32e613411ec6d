"""The held region of an object: a closed surface or a rule selects it, and tetrahedra end there.

A closed surface, `--fix-mesh bone.stl`, fixes the vertices inside it (`fix_surface.py`).

Tetrahedra are cut exactly where the held region ends, instead of ending it at the nearest node. If
only vertices inside the region were held, elements that lead out of it would be free over their
whole length: a beam held at "x < 10%" was up to one edge longer than the rule says, and 5 to 8 %
too soft. Edges with one end inside the region are therefore split where they leave
it, each in all tetrahedra round it, the longest edge first. Splitting one edge at a time keeps
neighbours conforming, and afterwards no tetrahedron has corners both inside and outside.

A rule, `--fix "z < 10%"`, has the grammar

    rule        := condition { "and" condition } { "or" ... }
    condition   := axis ("<" | "<=" | ">" | ">=") value
    axis        := "x" | "y" | "z"
    value       := number [ "%" | "m" | "cm" | "mm" ]

A value in % is a share of the object's extent along the axis, from 0% at the lowest coordinate to
100% at the highest; a length is a coordinate of the scaled object. "and" binds tighter than "or".
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from cohaptic.errors import SettingError
from cohaptic_server.mesh.tetrahedra import EDGES, TetMesh, boundary
from cohaptic_server.numeric import Floats, Ints, Mask
from cohaptic_server.objects.fix_mesh import FixMesh
from cohaptic_server.objects.fix_surface import FixSurface, inside
from cohaptic_server.objects.object_file import ObjectFile

Region = Callable[[Floats], Mask]  # points (n, 3) [m] to whether each is held
# If the region ends within this share of an edge from a vertex, the vertex itself is taken as its
# end: a split so close would make slivers. The error is at most this share of the edge.
NEAR = 0.1
_HALVINGS = 10  # bisections, which find the end of the region to a thousandth of the edge
_HELD, _ON, _FREE = -1, 0, 1


@dataclass(frozen=True, eq=False)
class Cut:
    """Tetrahedra that end where the held region ends.

    Args:
        tets: Tetrahedra after the cut; the vertices of the uncut mesh come first, in their order.
        fixed: Whether each vertex is held, shape (n,).
        parent: Index of the uncut tetrahedron that each tetrahedron comes from, shape (m,).
    """

    tets: TetMesh
    fixed: Mask
    parent: Ints


def cut_at(tets: TetMesh, inside: Mask, region: Region) -> Cut:
    """Split the tetrahedra of an object where a region ends.

    Args:
        inside: Whether each vertex of the object is inside the region, shape (n,).
        region: Function that says which points are inside the region.
    """
    x, t = tets.vertices, tets.tets
    pairs = np.sort(t[:, np.array(EDGES)].reshape(-1, 2), axis=1)
    edges = np.unique(pairs[inside[pairs[:, 0]] != inside[pairs[:, 1]]], axis=0)
    # Each edge points outwards, so that a share counts from the held end.
    edges = np.where(inside[edges[:, :1]], edges, edges[:, ::-1])
    fraction = _leaves(x[edges[:, 0]], x[edges[:, 1]], region)
    side = np.where(inside, _HELD, _FREE)
    side[edges[fraction < NEAR, 0]] = _ON
    side[edges[fraction > 1.0 - NEAR, 1]] = _ON
    split = side[edges[:, 0]] * side[edges[:, 1]] < 0
    edges, fraction = edges[split], fraction[split, None]
    middles = (1.0 - fraction) * x[edges[:, 0]] + fraction * x[edges[:, 1]]
    order = np.argsort(-np.linalg.norm(x[edges[:, 1]] - x[edges[:, 0]], axis=1), kind="stable")
    ends = np.sort(edges[order], axis=1).tolist()
    rank = {(a, b): k for k, (a, b) in enumerate(ends)}
    new, parent = _split(t, side, rank, len(x))
    fixed = np.concatenate([side != _FREE, np.ones(len(edges), dtype=np.bool_)])
    split = replace(tets, vertices=np.concatenate([x, middles[order]]), tets=new)
    return Cut(split, fixed, parent)


def _leaves(start: Floats, end: Floats, region: Region) -> Floats:
    """Share of the way from `start` to `end` at which each edge leaves the region, shape (e,)."""
    low, high = np.zeros(len(start)), np.ones(len(start))
    for _ in range(_HALVINGS if len(start) else 0):
        middle = 0.5 * (low + high)
        within = region(start + middle[:, None] * (end - start))
        low, high = np.where(within, middle, low), np.where(within, high, middle)
    return 0.5 * (low + high)


def _split(t: Ints, side: Ints, rank: dict[tuple[int, int], int], n: int) -> tuple[Ints, Ints]:
    """Split tetrahedra at the ranked edges; return them, and the index of the original of each.

    Args:
        t: Vertices of each tetrahedron, shape (m, 4).
        side: `_HELD`, `_ON` or `_FREE` for each vertex, shape (n,).
        rank: Place of each edge in the order of splitting; edge k gets the new vertex n + k.
        n: Number of vertices.
    """
    sides = side[t]
    is_cut = (sides == _HELD).any(axis=1) & (sides == _FREE).any(axis=1)
    made: list[list[int]] = []
    parents: list[int] = []
    for index in np.flatnonzero(is_cut).tolist():
        corners = t[index].tolist()
        order = sorted(
            (rank[edge], *edge)
            for a, b in EDGES
            if (edge := (min(corners[a], corners[b]), max(corners[a], corners[b]))) in rank
        )
        pieces = [corners]
        for number, a, b in order:
            pieces = [half for piece in pieces for half in _halves(piece, a, b, n + number)]
        made += pieces
        parents += [index] * len(pieces)
    kept = np.flatnonzero(~is_cut)
    new = np.array(made, dtype=np.int64).reshape(-1, 4)
    return np.concatenate([t[kept], new]), np.concatenate([kept, np.array(parents, dtype=np.int64)])


def _halves(corners: list[int], a: int, b: int, middle: int) -> list[list[int]]:
    """Split a tetrahedron at an edge into two halves; return it whole if it lacks the edge."""
    if a not in corners or b not in corners:
        return [corners]
    return [[middle if k == end else k for k in corners] for end in (a, b)]


GRAMMAR = 'like "z < 10%", "z < 10% or z > 90%", "x >= 2cm and y < 0.01m"'

_CONDITION = re.compile(
    r"\s*([xyz])\s*(<=|>=|<|>)\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?)\s*(%|mm|cm|m)?\s*",
    re.IGNORECASE,
)
_UNITS = {"m": 1.0, "": 1.0, "cm": 0.01, "mm": 0.001}


def hold(source: ObjectFile, tets: TetMesh) -> Cut:
    """Cut an object where its held region ends.

    Args:
        source: File with a rule in `fix`, or a surface in `fix_mesh`.
        tets: Tetrahedra of the object.

    Raises:
        SettingError: Not exactly one of the two is given, or nothing or everything is fixed.
        BodyError: The surface of `fix_mesh` cannot be read, or is not closed.
    """
    check_fix_given(source)
    x = tets.vertices
    if source.fix_mesh is None:
        fixed = fixed_by_rule(source.fix, x)
        return cut_at(tets, fixed, lambda points: _by_rule(source.fix, x, points))
    surface = FixSurface.of(source)
    fixed = surface.fixed(x, boundary(tets.tets))
    if not fixed.any():
        larger = "larger than the elements: no vertex of the mesh lies in it; take a smaller --edge"
        raise SettingError("--fix-mesh", str(surface.given), larger)
    y = surface.placed()
    return cut_at(tets, fixed, lambda points: inside(y, surface.faces, points))


def check_fix_given(source: ObjectFile) -> None:
    """Check that exactly one of --fix and --fix-mesh is given, before any file is read.

    Raises:
        SettingError: Neither of the two options is given, or both are, or --fix-mesh has a unit or
            axes that are not known.
    """
    if source.fix_mesh is None and not source.fix.strip():
        expected = 'a rule, or the object floats away: "z < 10%"'
        raise SettingError("--fix", "not given", expected)
    if source.fix_mesh is not None and source.fix.strip():
        raise SettingError("--fix-mesh", str(source.fix_mesh), "given without --fix")
    if source.fix_mesh is not None:
        FixMesh.of(source.fix_mesh)


def fixed_by_rule(rule: str, x: Floats) -> npt.NDArray[np.bool_]:
    """Whether a rule fixes each vertex, shape (n,).

    Args:
        rule: The rule, as the user wrote it.
        x: Vertices, shape (n, 3) [m].

    Raises:
        SettingError: The rule cannot be parsed, or fixes nothing or everything.
    """
    fixed = _by_rule(rule, x, x)
    if not fixed.any():
        ranges = ", ".join(
            f"{axis} from {x[:, k].min():.4g} to {x[:, k].max():.4g} m"
            for k, axis in enumerate("xyz")
        )
        expected = f"a rule that holds some of the object, or it would float away; it has {ranges}"
        raise SettingError("--fix", repr(rule), expected)
    if fixed.all():
        raise SettingError("--fix", repr(rule), "a rule that leaves something free to move")
    return fixed


def _by_rule(rule: str, x: Floats, points: Floats) -> npt.NDArray[np.bool_]:
    """Whether a rule holds each point, shape (n,); percentages refer to the extent of x."""
    fixed = np.zeros(len(points), dtype=np.bool_)
    for part in re.split(r"\bor\b", rule, flags=re.IGNORECASE):
        within = np.ones(len(points), dtype=np.bool_)
        for text in re.split(r"\band\b", part, flags=re.IGNORECASE):
            within &= _satisfied(text, rule, x, points)
        fixed |= within
    return fixed


def _satisfied(text: str, rule: str, x: Floats, points: Floats) -> npt.NDArray[np.bool_]:
    match = _CONDITION.fullmatch(text)
    if match is None:
        where = f" (at {text.strip()!r})" if text.strip() != rule.strip() else ""
        raise SettingError("--fix", repr(rule) + where, GRAMMAR)
    axis, sign, number, unit = match.group(1).lower(), *match.groups()[1:3], match.group(4) or ""
    along = x[:, "xyz".index(axis)]
    at = points[:, "xyz".index(axis)]
    if unit == "%":
        if not 0.0 <= float(number) <= 100.0:
            raise SettingError("--fix", repr(rule), "with shares from 0% to 100%")
        limit = along.min() + 0.01 * float(number) * np.ptp(along)
    else:
        limit = float(number) * _UNITS[unit.lower()]
    if sign == "<":
        return np.asarray(at < limit)
    if sign == "<=":
        return np.asarray(at <= limit)
    return np.asarray(at > limit) if sign == ">" else np.asarray(at >= limit)
