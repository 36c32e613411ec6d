"""Sparse Cholesky by fronts: K = L L', factored once, solved for many forces at a time.

The multifrontal method (Duff, Reid 1983; Liu 1992) on the tree of `dissection.py`: each part is a
dense front of its own nodes and the border to its ancestors, so that all arithmetic is LAPACK's.
Two savings are ours to take, since only the surface is pushed and only the surface is seen: going
up the tree, a force touches the fronts on its own path alone; going down, a front with no surface
under it is left out.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import scipy.linalg
import scipy.sparse as sp

from cohaptic.errors import BodyError
from cohaptic_server.bodies.dissection import Part, dissect
from cohaptic_server.bodies.mesh import Floats, Ints


@dataclass(frozen=True, eq=False)
class _Front:
    """A dense block of the factor.

    Args:
        own: Degrees of freedom eliminated here, shape (a,).
        border: Those of ancestors that they meet, shape (b,).
        lower: Cholesky factor of the own block, shape (a, a).
        below: L21, shape (b, a).
        parent: Place of the parent; -1 at the root.
        seen: Whether something under it is asked for.
    """

    own: Ints
    border: Ints
    lower: Floats
    below: Floats
    parent: int
    seen: bool


class Factor:
    """The Cholesky factor of a symmetric positive definite matrix of 3x3 blocks.

    Args:
        matrix: Shape (3 n, 3 n).
        points: Place of each node, shape (n, 3) [m].
        wanted: Nodes whose displacement is asked for, shape (n,) of bool.
        progress: Is told the share of the arithmetic that is done, from 0 to 1.

    Raises:
        BodyError: The matrix is not positive definite.
    """

    def __init__(
        self,
        matrix: sp.csr_array,
        points: Floats,
        wanted: np.ndarray[tuple[int], np.dtype[np.bool_]],
        progress: Callable[[float], None] | None = None,
    ) -> None:
        self.size = matrix.shape[0]
        graph = _graph(matrix)
        parts = dissect(points, graph)
        self._fronts = _eliminate(matrix, parts, _borders(graph, parts), wanted, progress)
        self._front_of = np.empty(len(points), dtype=np.int64)
        for k, part in enumerate(parts):
            self._front_of[part.own] = k

    @property
    def bytes(self) -> int:
        """Memory of the factor."""
        return sum(front.lower.nbytes + front.below.nbytes for front in self._fronts)

    def to_arrays(self) -> dict[str, npt.NDArray[Any]]:
        """All there is of it, by name, for `from_arrays`; the blocks are not copied."""
        fronts = self._fronts
        arrays: dict[str, npt.NDArray[Any]] = {
            "size": np.array([self.size], dtype=np.int64),
            "front_of": self._front_of,
            "own": np.concatenate([front.own for front in fronts]),
            "border": np.concatenate([front.border for front in fronts]),
            # Own, border, parent and seen, of each front.
            "fronts": np.array(
                [[len(f.own), len(f.border), f.parent, f.seen] for f in fronts], dtype=np.int64
            ),
        }
        for k, front in enumerate(fronts):
            arrays[f"lower{k}"] = front.lower
            arrays[f"below{k}"] = front.below
        return arrays

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, npt.NDArray[Any]]) -> Factor:
        """The factor of `to_arrays`; its blocks may be read-only, or mapped from a file.

        Raises:
            BodyError: The arrays do not fit together.
        """
        factor = cls.__new__(cls)
        try:
            factor.size = int(arrays["size"][0])
            factor._front_of = np.asarray(arrays["front_of"], dtype=np.int64)
            factor._fronts = _fronts(arrays, factor.size)
        except (KeyError, ValueError, IndexError) as error:
            raise BodyError(f"this is no factor: {error}") from error
        if 3 * len(factor._front_of) != factor.size or not _within(
            factor._front_of, len(factor._fronts)
        ):
            raise BodyError("this is no factor: its nodes and its fronts do not fit")
        return factor

    def solve(self, nodes: Ints, forces: Floats, *, everywhere: bool = False) -> Floats:
        """Displacement of the wanted nodes under forces on a few nodes.

        Args:
            nodes: With a force, shape (k,).
            forces: On them, one column for each case, shape (3 k, r) [N].
            everywhere: Whether all nodes are wanted now, those inside too.

        Returns:
            Shape (3 n, r) [m]; what is not wanted is not filled in.
        """
        x = np.zeros((self.size, forces.shape[1]))
        np.add.at(x, (3 * nodes[:, None] + np.arange(3)).ravel(), forces)
        for k in self._path(nodes):
            front = self._fronts[k]
            y = scipy.linalg.solve_triangular(
                front.lower, x[front.own], lower=True, check_finite=False
            )
            x[front.own] = y
            x[front.border] -= front.below @ y
        for front in reversed(self._fronts):
            if front.seen or everywhere:
                right = x[front.own] - front.below.T @ x[front.border]
                x[front.own] = scipy.linalg.solve_triangular(
                    front.lower, right, lower=True, trans=1, check_finite=False
                )
        return x

    def _path(self, nodes: Ints) -> list[int]:
        """Fronts that forces on `nodes` reach, children before parents."""
        found: set[int] = set()
        starts: list[int] = np.unique(self._front_of[nodes]).tolist()
        for k in starts:
            while k >= 0 and k not in found:
                found.add(k)
                k = self._fronts[k].parent
        return sorted(found)


def _graph(matrix: sp.csr_array) -> sp.csr_array:
    """Which nodes meet, from a matrix of 3x3 blocks."""
    n = matrix.shape[0] // 3
    rows = np.repeat(np.arange(3 * n), np.diff(matrix.indptr))[: matrix.nnz] // 3
    ones = np.ones(matrix.nnz, dtype=np.int8)
    graph = sp.csr_array(sp.coo_array((ones, (rows, matrix.indices // 3)), shape=(n, n)))
    return graph


def _borders(graph: sp.csr_array, parts: list[Part]) -> list[Ints]:
    """Nodes of ancestors that each part meets once its children are gone, by elimination order."""
    place = np.empty(graph.shape[0], dtype=np.int64)
    place[np.concatenate([part.own for part in parts])] = np.arange(graph.shape[0])
    last = -1
    borders: list[Ints] = []
    for part in parts:
        last += len(part.own)
        near = [np.asarray(graph[part.own].indices, dtype=np.int64)]
        met = np.unique(np.concatenate(near + [borders[child] for child in part.children]))
        met = met[place[met] > last]
        borders.append(met[np.argsort(place[met])])
    return borders


def _dof(nodes: Ints) -> Ints:
    return np.asarray((3 * nodes[:, None] + np.arange(3)).ravel(), dtype=np.int64)


def _eliminate(
    matrix: sp.csr_array,
    parts: list[Part],
    borders: list[Ints],
    wanted: np.ndarray[tuple[int], np.dtype[np.bool_]],
    progress: Callable[[float], None] | None,
) -> list[_Front]:
    work = np.cumsum(
        [_work(3 * len(p.own), 3 * len(b)) for p, b in zip(parts, borders, strict=True)]
    )
    parents = np.full(len(parts), -1)
    for k, part in enumerate(parts):
        for child in part.children:
            parents[child] = k
    local = np.full(matrix.shape[0], -1, dtype=np.int64)
    updates: dict[int, Floats] = {}
    fronts: list[_Front] = []
    for k, (part, border_nodes) in enumerate(zip(parts, borders, strict=True)):
        own, border = _dof(part.own), _dof(border_nodes)
        both = np.concatenate([own, border])
        local[both] = np.arange(len(both))
        dense = np.zeros((len(both), len(both)))
        rows = matrix[own]
        at = local[rows.indices]
        # Below the children lies what was eliminated there: their updates carry it.
        kept = at >= 0
        row = np.repeat(np.arange(len(own)), np.diff(rows.indptr))
        dense[at[kept], row[kept]] = rows.data[kept]
        for child in part.children:
            where = local[fronts[child].border]
            dense[np.ix_(where, where)] += updates.pop(child)
        local[both] = -1
        a = len(own)
        try:
            lower = np.asarray(
                scipy.linalg.cholesky(dense[:a, :a], lower=True, check_finite=False),
                dtype=np.float64,
            )
        except scipy.linalg.LinAlgError as error:
            raise BodyError(
                "the stiffness is not positive definite: the object can move"
            ) from error
        below = np.ascontiguousarray(
            scipy.linalg.solve_triangular(lower, dense[a:, :a].T, lower=True, check_finite=False).T
        )
        updates[k] = dense[a:, a:] - below @ below.T
        seen = bool(wanted[part.own].any()) or any(fronts[child].seen for child in part.children)
        fronts.append(_Front(own, border, lower, below, int(parents[k]), seen))
        if progress is not None:
            progress(float(work[k] / work[-1]))
    return fronts


def _work(a: int, b: int) -> float:
    """Multiplications in a front of so many own and border degrees of freedom, about."""
    return a**3 / 3.0 + float(a) * a * b + float(a) * b * b


def _fronts(arrays: Mapping[str, npt.NDArray[Any]], size: int) -> list[_Front]:
    """Fronts of a stored factor; raises ValueError or KeyError where they do not fit together."""
    table = np.asarray(arrays["fronts"], dtype=np.int64).reshape(-1, 4)
    owns = np.split(np.asarray(arrays["own"], dtype=np.int64), np.cumsum(table[:, 0])[:-1])
    borders = np.split(np.asarray(arrays["border"], dtype=np.int64), np.cumsum(table[:, 1])[:-1])
    fronts: list[_Front] = []
    for k, (own, border) in enumerate(zip(owns, borders, strict=True)):
        a, b, parent, seen = table[k].tolist()
        lower, below = arrays[f"lower{k}"], arrays[f"below{k}"]
        if lower.shape != (a, a) or below.shape != (b, a) or (len(own), len(border)) != (a, b):
            raise ValueError(f"front {k} has blocks of {lower.shape} and {below.shape}")
        if parent != -1 and not k < parent < len(owns):
            raise ValueError(f"front {k} has front {parent} above it")
        if not (_within(own, size) and _within(border, size)):
            raise ValueError(f"front {k} has places outside of the matrix")
        fronts.append(_Front(own, border, lower, below, parent, bool(seen)))
    return fronts


def _within(places: Ints, count: int) -> bool:
    return not len(places) or bool(places.min() >= 0 and places.max() < count)
