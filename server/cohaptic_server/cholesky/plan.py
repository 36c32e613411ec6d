"""Plans a factorisation from the pattern of the matrix alone: order, memory and arithmetic.

The number of bytes is exact and known before the arithmetic begins: all fronts' blocks lie in one
array, and the order of elimination determines which updates exist at one time (Liu 1992).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from cohaptic_server.cholesky.symbolic import Part, borders_of, dissect
from cohaptic_server.numeric import Floats, Ints, Mask

_DOUBLE = 8  # bytes
_BLOCK = 9 * (8 + 4)  # bytes of a block of a sparse matrix, its indices included


@dataclass(frozen=True, eq=False)
class Plan:
    """The fronts of a factorisation, children before their parents, with memory and arithmetic.

    Args:
        parts: Nodes that each front eliminates, and its children.
        borders: Nodes of ancestors to which each front is coupled, in order of elimination.
        kept: Whether the factor stores a front, since the front or a descendant has a retained
            node, shape (fronts,).
        parents: Index of each front's parent, -1 at the root, shape (fronts,).
        work: Floating-point operations up to the end of each front, shape (fronts,).
        factor_bytes: Bytes of the factor.
        peak_bytes: Largest number of bytes of the factor, the updates and the present front at one
            time, without the matrix itself.
        matrix_bytes: Bytes of the matrix, stored by rows.
        press_operations: Floating-point operations for a press on every retained node in turn.
    """

    parts: list[Part]
    borders: list[Ints]
    kept: Mask
    parents: Ints
    work: Floats
    factor_bytes: int
    peak_bytes: int
    matrix_bytes: int
    press_operations: float

    @property
    def operations(self) -> float:
        """Floating-point operations of the whole factorisation."""
        return float(self.work[-1])


def plan_of(graph: sp.csr_array, points: Floats, retained: Mask) -> Plan:
    """Order the elimination, and count its memory and arithmetic.

    Args:
        graph: Graph that links nodes with a nonzero 3x3 block, and each node to itself, (n, n).
        points: Position of each node, shape (n, 3) [m].
        retained: Whether a node is retained, since forces act on it and its displacement is
            observed, shape (n,).
    """
    parts = _split_leaves(dissect(points, graph), retained)
    borders = borders_of(graph, parts)
    kept = np.zeros(len(parts), dtype=np.bool_)
    parents = np.full(len(parts), -1, dtype=np.int64)
    for k, part in enumerate(parts):
        kept[k] = retained[part.own].any() or any(kept[child] for child in part.children)
        for child in part.children:
            parents[child] = k
    own = np.array([3 * len(part.own) for part in parts], dtype=np.float64)
    border = np.array([3 * len(b) for b in borders], dtype=np.float64)
    # Factor of the own block, two solves with this factor for the border, and half of the update.
    work = np.cumsum(own**3 / 3.0 + 2.0 * own**2 * border + own * border**2)
    factor, peak = _memory(parts, own, border, kept)
    presses = np.array([int(retained[part.own].sum()) for part in parts])
    path = 3.0 * own * (own + 2.0 * border)  # operations of one press in x, y and z
    for k in range(len(parts) - 2, -1, -1):
        path[k] += path[parents[k]]
    matrix = _BLOCK * graph.nnz
    pressed = float(presses @ path)
    return Plan(parts, borders, kept, parents, work, factor, peak, matrix, pressed)


def _memory(parts: list[Part], own: Floats, border: Floats, kept: Mask) -> tuple[int, int]:
    """Return the size of the factor and the largest size in use at one time [bytes]."""
    updates = border**2
    factor = live = peak = 0.0
    for k, part in enumerate(parts):
        blocks = own[k] * (own[k] + border[k])
        live += updates[k]
        peak = max(peak, factor + blocks + live)
        live -= sum(updates[child] for child in part.children)
        factor += blocks if kept[k] else 0.0
    return int(_DOUBLE * factor), int(_DOUBLE * peak)


def _split_leaves(parts: list[Part], retained: Mask) -> list[Part]:
    """Split each leaf, so that its retained nodes become the parent of its other nodes.

    The front of the other nodes can then be discarded, since no solve needs it.

    Args:
        parts: Parts, children before their parents.
        retained: Whether a node is retained, shape (n,).
    """
    out: list[Part] = []
    index: list[int] = []
    for part in parts:
        own, children = part.own, tuple(index[child] for child in part.children)
        if not children and 0 < retained[own].sum() < len(own):
            out.append(Part(own[~retained[own]], ()))
            own, children = own[retained[own]], (len(out) - 1,)
        index.append(len(out))
        out.append(Part(own, children))
    return out
