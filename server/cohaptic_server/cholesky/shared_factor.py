"""A Cholesky factor in single precision in memory that a second process maps instead of copying.

Sending a factor of 1 GB to a process takes seconds and holds it twice. Here all of it lies in
shared memory, and what travels is where. A process that is started gets little in any case: one
that dies before it has read what is sent to it would leave the sender waiting for ever.
"""

from __future__ import annotations

from multiprocessing.context import SpawnContext
from typing import Any

import numpy as np

from cohaptic_server.cholesky.factor import Factor
from cohaptic_server.cholesky.factor_file import (
    copy_values,
    count_values,
    from_arrays,
    indices_of,
)
from cohaptic_server.numeric import Ints, Narrow


class SharedFactor:
    """A factor in shared memory.

    Args:
        factor: Any precision; its numbers are copied once.
        context: Context of multiprocessing for the process that shall map them.

    Attributes:
        bytes: Memory of its numbers.

    Raises:
        OSError: There is not enough shared memory.
    """

    def __init__(self, factor: Factor, context: SpawnContext) -> None:
        indices = indices_of(factor)
        self._indices = {name: shared_ints(array, context) for name, array in indices.items()}
        self._values: Any = context.RawArray("f", max(1, count_values(factor)))
        self.bytes = 4 * count_values(factor)
        copy_values(factor, self._numbers())

    def read(self) -> Factor:
        """The factor on the shared numbers, which are not copied."""
        indices = {name: as_ints(shared) for name, shared in self._indices.items()}
        return from_arrays({**indices, "values": self._numbers()})

    def problem(self) -> str:
        """Nobody but these two processes can change it."""
        return ""

    def _numbers(self) -> Narrow:
        return np.frombuffer(self._values, dtype=np.float32)[: self.bytes // 4]


def shared_ints(array: Ints, context: SpawnContext) -> tuple[Any, tuple[int, ...]]:
    """A copy of an array in shared memory, and its shape."""
    shared = context.RawArray("q", max(1, array.size))
    np.frombuffer(shared, dtype=np.int64)[: array.size] = array.ravel()
    return shared, array.shape


def as_ints(shared: tuple[Any, tuple[int, ...]]) -> Ints:
    """The array of `shared_ints`, not copied."""
    memory, shape = shared
    count = int(np.prod(shape))
    return np.frombuffer(memory, dtype=np.int64)[:count].reshape(shape)
