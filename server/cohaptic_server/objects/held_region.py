"""Cuts tetrahedra where the held region ends, so that a rule is met to the metre and not the node.

Holding the vertices inside a region lets go of all of the element that leads out of it: a beam
held at "x < 10%" was up to one edge longer than the rule says, 5 to 8 % too soft (decision 34).
Edges with one end inside the region are split where they leave it, each in all of its tetrahedra,
the longest edge first: splitting one edge at a time keeps neighbours conforming, and no tetrahedron
is left with a corner inside and another one outside.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from cohaptic_server.mesh.tetrahedra import EDGES, TetMesh
from cohaptic_server.numeric import Floats, Ints, Mask

Region = Callable[[Floats], Mask]  # which of some points, shape (n, 3) [m], are held
# Share of an edge below which its end is taken for the place where the region ends: a split closer
# to it makes slivers, and the error is that share of an edge.
NEAR = 0.1
_HALVINGS = 10  # of an edge, to find where it leaves the region: to a thousandth of its length
_HELD, _ON, _FREE = -1, 0, 1


@dataclass(frozen=True, eq=False)
class Cut:
    """Tetrahedra that end where the held region ends.

    Args:
        tets: The object; vertices of the mesh before come first, in their order.
        fixed: Which vertices do not move, shape (n,).
        parent: Tetrahedron before the cut of each one, shape (m,).
    """

    tets: TetMesh
    fixed: Mask
    parent: Ints


def cut_at(tets: TetMesh, inside: Mask, region: Region) -> Cut:
    """Split tetrahedra where a region ends.

    Args:
        tets: The object.
        inside: Which of its vertices are inside the region, shape (n,).
        region: The region.
    """
    x, t = tets.vertices, tets.tets
    pairs = np.sort(t[:, np.array(EDGES)].reshape(-1, 2), axis=1)
    edges = np.unique(pairs[inside[pairs[:, 0]] != inside[pairs[:, 1]]], axis=0)
    # From the inside out, so that a share counts from the held end.
    edges = np.where(inside[edges[:, :1]], edges, edges[:, ::-1])
    share = _leaves(x[edges[:, 0]], x[edges[:, 1]], region)
    side = np.where(inside, _HELD, _FREE)
    side[edges[share < NEAR, 0]] = _ON
    side[edges[share > 1.0 - NEAR, 1]] = _ON
    split = side[edges[:, 0]] * side[edges[:, 1]] < 0
    edges, share = edges[split], share[split, None]
    middles = (1.0 - share) * x[edges[:, 0]] + share * x[edges[:, 1]]
    order = np.argsort(-np.linalg.norm(x[edges[:, 1]] - x[edges[:, 0]], axis=1), kind="stable")
    ends = np.sort(edges[order], axis=1).tolist()
    rank = {(a, b): k for k, (a, b) in enumerate(ends)}
    new, parent = _split(t, side, rank, len(x))
    fixed = np.concatenate([side != _FREE, np.ones(len(edges), dtype=np.bool_)])
    return Cut(TetMesh(np.concatenate([x, middles[order]]), new), fixed, parent)


def _leaves(start: Floats, end: Floats, region: Region) -> Floats:
    """Share of each edge at which it leaves the region that it starts in, shape (e,)."""
    low, high = np.zeros(len(start)), np.ones(len(start))
    for _ in range(_HALVINGS if len(start) else 0):
        middle = 0.5 * (low + high)
        within = region(start + middle[:, None] * (end - start))
        low, high = np.where(within, middle, low), np.where(within, high, middle)
    return 0.5 * (low + high)


def _split(t: Ints, side: Ints, rank: dict[tuple[int, int], int], n: int) -> tuple[Ints, Ints]:
    """Tetrahedra with the ranked edges split, and the one that each comes from.

    Args:
        t: Shape (m, 4).
        side: Side of each vertex.
        rank: Rank of the edges to split, from the first; edge k gets vertex n + k.
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
    """The two parts of a tetrahedron split at an edge; itself if it does not have the edge."""
    if a not in corners or b not in corners:
        return [corners]
    return [[middle if k == end else k for k in corners] for end in (a, b)]
