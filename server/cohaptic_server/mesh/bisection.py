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
from cohaptic_server.numeric import Floats, Ints, Mask

_EDGES = np.array(EDGES)
_SHRINK = 0.9  # from one excess to the next; all edges of a level are split before a shorter one
_MOST_PASSES = 100  # for one excess; 8 were the most of plates, rods and bowls


@dataclass(frozen=True, eq=False)
class Bisected:
    """Tetrahedra after edges were split.

    Args:
        tets: Vertices of the mesh before come first, in their order.
        parent: Tetrahedron before of each one, shape (m,).
        wanted: Longest edge that is wanted at each vertex, infinite where any will do, shape (n,)
            [m]. Between two vertices it is the longer one of theirs.
        excess: The edges are no longer than so many times what is wanted: 1, or more where there
            was no room, or less where nothing had to be split.
    """

    tets: TetMesh
    parent: Ints
    wanted: Floats
    excess: float


def with_shorter_edges(tets: TetMesh, wanted: Floats, most: int) -> Bisected:
    """Split edges until none is longer than is wanted where it lies.

    Args:
        tets: The object.
        wanted: Longest edge at each vertex, shape (n,) [m]; infinite where any will do. The middle
            of an edge wants the mean of its ends.
        most: Tetrahedra that there may be. Multiples of the wanted lengths are tried from the
            longest down, and the last one for which there is room is taken.
    """
    start = longest_over_wanted(tets, wanted)
    now = Bisected(tets, np.arange(len(tets.tets), dtype=np.int64), wanted, start)
    steps = math.ceil(math.log(start) / -math.log(_SHRINK)) if start > 1.0 else 0
    for step in range(1, steps + 1):
        after = _split_to(now, max(1.0, start * _SHRINK**step), most)
        if after is None:
            break
        now = after
    return now


def longest_over_wanted(tets: TetMesh, wanted: Floats) -> float:
    """The most that an edge is longer than is wanted there, as a ratio; 0 where any will do."""
    edges = tets.tets[:, _EDGES].reshape(-1, 2)
    along = tets.vertices[edges[:, 1]] - tets.vertices[edges[:, 0]]
    ratio = np.linalg.norm(along, axis=1) / wanted[edges].max(axis=1)
    return float(ratio.max(initial=0.0))


def _split_to(mesh: Bisected, excess: float, most: int) -> Bisected | None:
    """The mesh with no edge over a multiple of what is wanted; None where there is no room."""
    for _ in range(_MOST_PASSES):
        after = _split_once(mesh, excess)
        if after is None:
            break
        if len(after.parent) > most:
            return None
        mesh = after
    return Bisected(mesh.tets, mesh.parent, mesh.wanted, excess)


def _split_once(mesh: Bisected, excess: float) -> Bisected | None:
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
    split = _on_the_way(of, longest, lengths > excess * mesh.wanted[edges].max(axis=1))
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
    parent = np.concatenate([mesh.parent[~hit], mesh.parent[hit], mesh.parent[hit]])
    wanted = np.concatenate([mesh.wanted, mesh.wanted[edges[split]].mean(axis=1)])
    return Bisected(TetMesh(new, np.concatenate([t[~hit], *halves])), parent, wanted, mesh.excess)


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
