"""Sparse Cholesky by fronts: K = L D L', factored once, solved for many forces at a time.

The multifrontal method (Duff, Reid 1983; Liu 1992) on the tree of `dissection.py`: each part is a
dense front of its own nodes and the border to its ancestors, so that all arithmetic is LAPACK's.
L has a block for each front, K21 K11^-1 of it, and D the blocks K11, as Cholesky factors: going
down needs L alone, so D is read only where there is a force.

Only the surface is pushed and only the surface is seen. Going up the tree, a force touches the
fronts on its own path; going down, only fronts on the way to what is asked for count. Fronts
without a surface under them are forgotten once they are eliminated.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from copy import copy
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt
import scipy.linalg
import scipy.sparse as sp

from cohaptic.errors import BodyError
from cohaptic_server.cholesky.dissection import Part, dissect
from cohaptic_server.cholesky.symbolic import borders_of, dofs, graph_of
from cohaptic_server.numeric import Floats, Ints

AnyFloats = npt.NDArray[np.float32 | np.float64]


@dataclass(frozen=True, eq=False)
class _Front:
    """A dense block of the factor.

    Args:
        own: Degrees of freedom eliminated here, shape (a,).
        border: Those of ancestors that they meet, shape (b,).
        lower: Cholesky factor of the own block, shape (a, a).
        carry: What a force on each own one does to the border, K21 K11^-1, shape (b, a).
        parent: Place of the parent; -1 at the root.
        seen: Whether something under it is asked for; if not, `lower` and `carry` are empty.
    """

    own: Ints
    border: Ints
    lower: AnyFloats
    carry: AnyFloats
    parent: int
    seen: bool


class Factor:
    """The Cholesky factor of a symmetric positive definite matrix of 3x3 blocks.

    Args:
        matrix: Shape (3 n, 3 n).
        points: Place of each node, shape (n, 3) [m].
        wanted: Nodes that are pushed and whose displacement is asked for, shape (n,) of bool.
        progress: Is told the share of the arithmetic that is done, from 0 to 1.

    Raises:
        BodyError: The matrix is not positive definite.
    """

    def __init__(
        self,
        matrix: sp.csr_array,
        points: Floats,
        wanted: np.ndarray[tuple[int], np.dtype[np.bool_]],
        progress: Callable[[float], None] = lambda share: None,
    ) -> None:
        self.size = matrix.shape[0]
        graph = graph_of(matrix)
        parts = _unwanted_first(dissect(points, graph), wanted)
        self._fronts = _eliminate(matrix, parts, borders_of(graph, parts), wanted, progress)
        self._front_of = np.empty(len(points), dtype=np.int64)
        for k, part in enumerate(parts):
            self._front_of[part.own] = k

    @property
    def bytes(self) -> int:
        """Memory of the factor."""
        return sum(front.lower.nbytes + front.carry.nbytes for front in self._fronts)

    def single(self) -> Factor:
        """The same with half of the digits and of the memory, for solves in half of the time."""
        rounded = copy(self)
        rounded._fronts = [
            replace(f, lower=f.lower.astype(np.float32), carry=f.carry.astype(np.float32))
            for f in self._fronts
        ]
        return rounded

    def to_arrays(self) -> dict[str, npt.NDArray[Any]]:
        """All there is of it, by name, for `from_arrays`; the blocks are not copied."""
        fronts = self._fronts
        table = [[len(f.own), len(f.border), f.parent, f.seen] for f in fronts]
        arrays: dict[str, npt.NDArray[Any]] = {
            "fronts": np.array(table, dtype=np.int64),
            "front_of": self._front_of,
            "own": np.concatenate([front.own for front in fronts]),
            "border": np.concatenate([front.border for front in fronts]),
        }
        for k, front in enumerate(fronts):
            if front.seen:
                arrays[f"lower{k}"], arrays[f"carry{k}"] = front.lower, front.carry
        return arrays

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, npt.NDArray[Any]]) -> Factor:
        """The factor of `to_arrays`; its blocks may be read-only, or mapped from a file.

        Raises:
            BodyError: The arrays do not fit together.
        """
        factor = cls.__new__(cls)
        try:
            factor._front_of = np.asarray(arrays["front_of"], dtype=np.int64)
            factor.size = 3 * len(factor._front_of)
            factor._fronts = _fronts(arrays, factor.size)
        except (KeyError, ValueError, IndexError) as error:
            raise BodyError(f"this is no factor: {error}") from error
        if not _within(factor._front_of, len(factor._fronts)):
            raise BodyError("this is no factor: a node is in a front that is not there")
        return factor

    def solve(self, nodes: Ints, forces: Floats, at: Ints | None = None) -> AnyFloats:
        """Displacement of the wanted nodes under forces on a few of them.

        Args:
            nodes: With a force, shape (k,).
            forces: On them, one column for each case, shape (3 k, r) [N].
            at: Nodes whose displacement counts, shape (j,); all that are wanted if not given. A few
                that lie together cost a fraction of all.

        Returns:
            Shape (3 n, r) [m]; what is not asked for is not filled in.
        """
        x = np.zeros((self.size, forces.shape[1]), dtype=self._fronts[-1].lower.dtype)
        np.add.at(x, dofs(nodes), forces.astype(x.dtype, copy=False))
        for front in self._path(nodes):
            x[front.border] -= front.carry @ x[front.own]
            x[front.own] = scipy.linalg.cho_solve(
                (front.lower, True), x[front.own], check_finite=False
            )
        for front in reversed(self._fronts if at is None else self._path(at)):
            if front.seen and len(front.border):
                x[front.own] -= front.carry.T @ x[front.border]
        return x

    def _path(self, nodes: Ints) -> list[_Front]:
        """Fronts from `nodes` up to the root, children before parents."""
        found: set[int] = set()
        starts: list[int] = np.unique(self._front_of[nodes]).tolist()
        for k in starts:
            while k >= 0 and k not in found:
                found.add(k)
                k = self._fronts[k].parent
        return [self._fronts[k] for k in sorted(found)]


def _unwanted_first(
    parts: list[Part], wanted: np.ndarray[tuple[int], np.dtype[np.bool_]]
) -> list[Part]:
    """Leaves cut in two: what nobody asks for under the rest, so that no solve goes there."""
    out: list[Part] = []
    place: list[int] = []
    for part in parts:
        own, children = part.own, tuple(place[child] for child in part.children)
        if not children and 0 < wanted[own].sum() < len(own):
            out.append(Part(own[~wanted[own]], ()))
            own, children = own[wanted[own]], (len(out) - 1,)
        place.append(len(out))
        out.append(Part(own, children))
    return out


def _solved(lower: Floats, right: Floats, *, transposed: bool = False) -> Floats:
    x = scipy.linalg.solve_triangular(
        lower, right, lower=True, trans=1 if transposed else 0, check_finite=False
    )
    return np.asarray(x, dtype=np.float64)


def _eliminate(
    matrix: sp.csr_array,
    parts: list[Part],
    borders: list[Ints],
    wanted: np.ndarray[tuple[int], np.dtype[np.bool_]],
    progress: Callable[[float], None],
) -> list[_Front]:
    sizes = [(3 * len(part.own), 3 * len(b)) for part, b in zip(parts, borders, strict=True)]
    work = np.cumsum([a**3 / 3 + a * a * b + a * b * b for a, b in sizes])
    parents = np.full(len(parts), -1)
    for k, part in enumerate(parts):
        for child in part.children:
            parents[child] = k
    local = np.full(matrix.shape[0], -1, dtype=np.int64)
    updates: dict[int, Floats] = {}
    fronts: list[_Front] = []
    for k, (part, border_nodes) in enumerate(zip(parts, borders, strict=True)):
        own, border = dofs(part.own), dofs(border_nodes)
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
        half = _solved(lower, dense[a:, :a].T).T
        updates[k] = dense[a:, a:] - half @ half.T
        seen = bool(wanted[part.own].any()) or any(fronts[child].seen for child in part.children)
        if seen:
            carry = np.ascontiguousarray(_solved(lower, half.T, transposed=True).T)
        else:
            lower, carry = np.empty((0, 0)), np.empty((0, 0))
        fronts.append(_Front(own, border, lower, carry, int(parents[k]), seen))
        progress(float(work[k] / work[-1]))
    return fronts


def _fronts(arrays: Mapping[str, npt.NDArray[Any]], size: int) -> list[_Front]:
    """Fronts of a stored factor; ValueError or KeyError where they do not fit together."""
    table = np.asarray(arrays["fronts"], dtype=np.int64).reshape(-1, 4)
    owns = np.split(np.asarray(arrays["own"], dtype=np.int64), np.cumsum(table[:, 0])[:-1])
    borders = np.split(np.asarray(arrays["border"], dtype=np.int64), np.cumsum(table[:, 1])[:-1])
    nothing: Floats = np.empty((0, 0))
    fronts: list[_Front] = []
    for k, (own, border) in enumerate(zip(owns, borders, strict=True)):
        a, b, parent, seen = table[k].tolist()
        lower, carry = (arrays[f"lower{k}"], arrays[f"carry{k}"]) if seen else (nothing, nothing)
        shapes = ((a, a), (b, a)) if seen else ((0, 0), (0, 0))
        if (len(own), len(border), lower.shape, carry.shape) != (a, b, *shapes):
            raise ValueError(f"front {k} has blocks of {lower.shape} and {carry.shape}")
        if parent != -1 and not k < parent < len(owns):
            raise ValueError(f"front {k} has front {parent} above it")
        if not (_within(own, size) and _within(border, size)):
            raise ValueError(f"front {k} has places outside of the matrix")
        fronts.append(_Front(own, border, lower, carry, parent, bool(seen)))
    return fronts


def _within(places: Ints, count: int) -> bool:
    return not len(places) or bool(places.min() >= 0 and places.max() < count)
