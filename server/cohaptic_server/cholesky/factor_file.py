"""Stores a Cholesky factor in a file or in shared memory, as arrays, and reads it back.

The numbers of a factor lie in one flat array, front after front: `lower` column by column, as
LAPACK takes it without a copy, then `carry` row by row. Numbers in single precision halve the
memory and the time of a solve; a factor stays in double precision if a later step needs that.

A shared factor is in single precision, and a second process maps it instead of copying it. Sending
a factor of 1 GB to a process takes seconds and keeps it in memory twice. Here the whole factor lies
in shared memory, and only a reference to it is sent. A new process may be sent only little data in
any case: if the process died before it had read all data, the sender would wait for ever.
"""

from __future__ import annotations

from collections.abc import Mapping
from multiprocessing.context import SpawnContext
from typing import Any

import numpy as np
import numpy.typing as npt

from cohaptic.errors import BodyError
from cohaptic_server.cholesky.factor import Factor, FactorFront
from cohaptic_server.cholesky.values import AnyFloats
from cohaptic_server.numeric import Ints, Narrow


def to_arrays(
    factor: Factor, precision: type[np.float32] | type[np.float64] = np.float32
) -> dict[str, npt.NDArray[Any]]:
    """Return all arrays of a factor by name, for `from_arrays`; numbers are copied only if needed.

    Args:
        factor: Factor of any precision.
        precision: Precision of the numbers, `np.float32` or `np.float64`.
    """
    values: npt.NDArray[Any] | None = factor.numbers
    if values is None or values.dtype != precision:
        values = np.empty(count_values(factor), dtype=precision)
        copy_values(factor, values)
    return {**indices_of(factor), "values": values, "multiple": np.array(factor.multiple)}


def indices_of(factor: Factor) -> dict[str, npt.NDArray[Any]]:
    """Return the arrays of `to_arrays` except for the numbers: the structure of the factor."""
    fronts = factor.fronts
    table = [[len(f.own), len(f.border), f.parent, f.retained] for f in fronts]
    return {
        "fronts": np.array(table, dtype=np.int64),
        "front_of": factor.front_of,
        "own": np.concatenate([front.own for front in fronts]),
        "border": np.concatenate([front.border for front in fronts]),
    }


def count_values(factor: Factor) -> int:
    """Return how many numbers `lower` and `carry` of all fronts contain."""
    return sum(front.lower.size + front.carry.size for front in factor.fronts)


def stored_bytes(fronts: npt.NDArray[Any]) -> int:
    """Return the size of a factor's numbers in single precision [bytes].

    Args:
        fronts: Array `fronts` of the factor, as `indices_of` makes it.
    """
    table = np.asarray(fronts, dtype=np.int64).reshape(-1, 4)
    own, border, kept = table[:, 0], table[:, 1], table[:, 3] != 0
    return 4 * int((own * (own + border))[kept].sum())


def copy_values(factor: Factor, out: npt.NDArray[Any]) -> None:
    """Copy the numbers of a factor to `out`, rounded to its precision.

    Args:
        out: Array of shape (count_values(factor),).
    """
    start = 0
    for front in factor.fronts:
        for block in (front.lower.T, front.carry):
            out[start : start + block.size].reshape(block.shape)[...] = block
            start += block.size


def from_arrays(arrays: Mapping[str, npt.NDArray[Any]]) -> Factor:
    """Rebuild a factor from the arrays that `to_arrays` returned.

    Args:
        arrays: Arrays by name; `values` may be read-only, or map a file.

    Raises:
        BodyError: The arrays do not fit together.
    """
    try:
        front_of = np.asarray(arrays["front_of"], dtype=np.int64)
        values = _numbers(arrays)
        fronts = _fronts(arrays, values, 3 * len(front_of))
        multiple = float(np.asarray(arrays["multiple"]))
    except (KeyError, ValueError, IndexError, TypeError) as error:
        raise BodyError(f"this is no factor: {error}") from error
    if not (multiple > 0.0 and np.isfinite(multiple)):
        raise BodyError(f"this is no factor: it is {multiple:g} times a matrix")
    if not _within(front_of, len(fronts)):
        raise BodyError("this is no factor: a node is in a front that is not there")
    return Factor(fronts, front_of, values, multiple)


def _numbers(arrays: Mapping[str, npt.NDArray[Any]]) -> AnyFloats:
    values = np.asarray(arrays["values"]).reshape(-1)
    return values if values.dtype == np.float64 else values.astype(np.float32, copy=False)


def _fronts(
    arrays: Mapping[str, npt.NDArray[Any]], values: AnyFloats, size: int
) -> list[FactorFront]:
    """Build the fronts of a stored factor of `size` unknowns, and check them.

    Raises:
        ValueError: The arrays do not fit together.
        KeyError: An array is missing.
    """
    table = np.asarray(arrays["fronts"], dtype=np.int64).reshape(-1, 4)
    owns = np.split(np.asarray(arrays["own"], dtype=np.int64), np.cumsum(table[:, 0])[:-1])
    borders = np.split(np.asarray(arrays["border"], dtype=np.int64), np.cumsum(table[:, 1])[:-1])
    if stored_bytes(table) != 4 * len(values):
        raise ValueError(f"{len(values)} numbers do not fill its fronts")
    fronts: list[FactorFront] = []
    start = 0
    rows: list[list[int]] = table.tolist()
    for k, (own, border) in enumerate(zip(owns, borders, strict=True)):
        wide, high, parent, retained = rows[k]
        if (len(own), len(border)) != (wide, high):
            raise ValueError(f"front {k} has {len(own)} unknowns and {len(border)} in its border")
        if parent != -1 and not k < parent < len(owns):
            raise ValueError(f"front {k} has front {parent} above it")
        if not (_within(own, size) and _within(border, size)):
            raise ValueError(f"front {k} has places outside of the matrix")
        if not retained:
            wide, high = 0, 0
        middle, end = start + wide * wide, start + wide * (wide + high)
        lower = values[start:middle].reshape(wide, wide).T
        carry = values[middle:end].reshape(high, wide)
        fronts.append(FactorFront(own, border, lower, carry, parent, bool(retained)))
        start = end
    return fronts


def _within(indices: Ints, count: int) -> bool:
    return not len(indices) or bool(indices.min() >= 0 and indices.max() < count)


class SharedFactor:
    """A factor in shared memory, which a new process can read without a copy (`FactorReader`).

    Args:
        factor: Factor of any precision; its numbers are copied once.
        context: Context of multiprocessing that starts the process that maps the numbers.

    Attributes:
        bytes: Memory of the numbers [bytes].

    Raises:
        OSError: There is not enough shared memory.
    """

    def __init__(self, factor: Factor, context: SpawnContext) -> None:
        indices = indices_of(factor)
        self._indices = {name: shared_ints(array, context) for name, array in indices.items()}
        self._values: Any = context.RawArray("f", max(1, count_values(factor)))
        self._multiple = factor.multiple
        self.bytes = 4 * count_values(factor)
        copy_values(factor, self._numbers())

    def read(self) -> Factor:
        """Return a factor that uses the shared numbers without a copy."""
        indices = {name: as_ints(shared) for name, shared in self._indices.items()}
        own = {"values": self._numbers(), "multiple": np.array(self._multiple)}
        return from_arrays({**indices, **own})

    def problem(self) -> str:
        """Return an empty string: only the two processes that share the factor can change it."""
        return ""

    def _numbers(self) -> Narrow:
        return np.frombuffer(self._values, dtype=np.float32)[: self.bytes // 4]


def shared_ints(array: Ints, context: SpawnContext) -> tuple[Any, tuple[int, ...]]:
    """Return a copy of an array in shared memory, and its shape."""
    shared = context.RawArray("q", max(1, array.size))
    np.frombuffer(shared, dtype=np.int64)[: array.size] = array.ravel()
    return shared, array.shape


def as_ints(shared: tuple[Any, tuple[int, ...]]) -> Ints:
    """Return the array that `shared_ints` put into shared memory, without a copy."""
    memory, shape = shared
    count = int(np.prod(shape))
    return np.frombuffer(memory, dtype=np.int64)[:count].reshape(shape)
