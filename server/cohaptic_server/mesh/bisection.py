"""Tetrahedra with shorter edges in chosen places, by bisection of longest edges (Rivara 1984).

An edge is split in its middle, in all tetrahedra round it, once it is the longest in each of them;
where a wanted edge is not, the longer ones beside it are split first. Neighbours conform after each
split, and elements get no flatter than a bounded share of what they were. A layer one element thick
is split along itself and not through its thickness, as its long edges lie along it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from cohaptic_server.mesh.tetrahedra import EDGES, TetMesh
from cohaptic_server.numeric import Ints, Mask

_EDGES = np.array(EDGES)
_SHRINK = 0.8  # from one length to the next: all edges of a level are split before a shorter one
_MOST_PASSES = 100  # for one length; 8 were the most of plates, rods and bowls


@dataclass(frozen=True, eq=False)
class Bisected:
    """Tetrahedra after edges were split.

    Args:
        tets: Vertices of the mesh before come first, in their order.
        parent: Tetrahedron before of each one, shape (m,).
        chosen: The vertices between which edges are wanted short, shape (n,).
        length: To which they are: the one asked for, or more where there was no room.
    """

    tets: TetMesh
    parent: Ints
    chosen: Mask
    length: float


def with_shorter_edges(tets: TetMesh, chosen: Mask, length: float, most: int) -> Bisected:
    """Split edges between chosen vertices until none is longer than a length.

    Args:
        tets: The object.
        chosen: Vertices, shape (n,); the middle of an edge between two of them is chosen too.
        length: Longest edge that is wanted there [m].
        most: Tetrahedra that there may be. The lengths are tried from the longest down, and the
            last one for which there is room is taken.
    """
    start = longest_between(tets, chosen)
    now = Bisected(tets, np.arange(len(tets.tets), dtype=np.int64), chosen, start)
    steps = math.ceil(math.log(start / length) / -math.log(_SHRINK)) if start > length else 0
    for step in range(1, steps + 1):
        wanted = max(length, start * _SHRINK**step)
        after = _split_to(now, wanted, most)
        if after is None:
            break
        now = after
    return now


def longest_between(tets: TetMesh, chosen: Mask) -> float:
    """The longest edge between chosen vertices [m]; 0 where there is none."""
    a, b = tets.tets[:, _EDGES[:, 0]], tets.tets[:, _EDGES[:, 1]]
    both = chosen[a] & chosen[b]
    lengths = np.linalg.norm(tets.vertices[a[both]] - tets.vertices[b[both]], axis=1)
    return float(lengths.max(initial=0.0))


def _split_to(mesh: Bisected, length: float, most: int) -> Bisected | None:
    """The mesh with no longer edge between chosen vertices; None where there is no room."""
    for _ in range(_MOST_PASSES):
        after = _split_once(mesh, length)
        if after is None:
            break
        if len(after.parent) > most:
            return None
        mesh = after
    return Bisected(mesh.tets, mesh.parent, mesh.chosen, length)


def _split_once(mesh: Bisected, length: float) -> Bisected | None:
    """Split what can be split at once: edges longest in all of their tetrahedra; None if none."""
    x, t = mesh.tets.vertices, mesh.tets.tets
    pairs = np.sort(t[:, _EDGES].reshape(-1, 2), axis=1)
    numbers, first, of = np.unique(
        pairs[:, 0] * len(x) + pairs[:, 1], return_index=True, return_inverse=True
    )
    edges, of = pairs[first], of.reshape(-1, 6)
    lengths = np.linalg.norm(x[edges[:, 1]] - x[edges[:, 0]], axis=1)
    # Edges of one length have an order too, the same in all tetrahedra: one of them is longest.
    rank = np.empty(len(numbers), dtype=np.int64)
    rank[np.argsort(lengths, kind="stable")] = np.arange(len(numbers))
    place = rank[of].argmax(axis=1)
    longest = of[np.arange(len(t)), place]
    over = mesh.chosen[edges].all(axis=1) & (lengths > length)
    split = _on_the_way(of, longest, over)
    split &= np.bincount(longest, minlength=len(numbers)) == np.bincount(of.ravel())
    if not split.any():
        return None
    middle = len(x) + np.cumsum(split) - 1
    hit = split[longest]
    rows, ends = np.arange(int(hit.sum())), _EDGES[place[hit]]
    halves = [t[hit], t[hit]]
    for half, end in zip(halves, ends.T, strict=True):
        half[rows, end] = middle[longest[hit]]
    new = np.concatenate([x, x[edges[split]].mean(axis=1)])
    chosen = np.concatenate([mesh.chosen, mesh.chosen[edges[split]].all(axis=1)])
    parent = np.concatenate([mesh.parent[~hit], mesh.parent[hit], mesh.parent[hit]])
    return Bisected(TetMesh(new, np.concatenate([t[~hit], *halves])), parent, chosen, mesh.length)


def _on_the_way(of: Ints, longest: Ints, over: Mask) -> Mask:
    """Edges that are longest in a tetrahedron through which the way to a wanted split leads.

    Args:
        of: Edges of each tetrahedron, shape (m, 6).
        longest: The longest of them, shape (m,).
        over: Edges that are wanted to be split, shape (e,).
    """
    needed = over[of].any(axis=1)
    while True:
        found = np.zeros(len(over), dtype=np.bool_)
        found[longest[needed]] = True
        further = found[of].any(axis=1)
        if not (further & ~needed).any():
            return found
        needed |= further
