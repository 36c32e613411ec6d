"""A Cholesky factor in single precision in memory that a second process maps instead of copying.

Sending a factor of 1 GB to a process takes seconds and holds it twice. Here the whole factor lies
in shared memory, and only its place is sent. Little may be sent to a process that is started in any
case: if it died before it had read all of that, the sender would wait for ever.
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
        factor: Factor of any precision; its numbers are copied once.
        context: Context of multiprocessing for the process that shall map the numbers.

    Attributes:
        bytes: Bytes of the numbers.

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
        """Return the factor on the shared numbers, which are not copied."""
        indices = {name: as_ints(shared) for name, shared in self._indices.items()}
        return from_arrays({**indices, "values": self._numbers()})

    def problem(self) -> str:
        """Return no problem: only these two processes can change the factor."""
        return ""

    def _numbers(self) -> Narrow:
        return np.frombuffer(self._values, dtype=np.float32)[: self.bytes // 4]


def shared_ints(array: Ints, context: SpawnContext) -> tuple[Any, tuple[int, ...]]:
    """Return a copy of an array in shared memory, and its shape."""
    shared = context.RawArray("q", max(1, array.size))
    np.frombuffer(shared, dtype=np.int64)[: array.size] = array.ravel()
    return shared, array.shape


def as_ints(shared: tuple[Any, tuple[int, ...]]) -> Ints:
    """Return the array of `shared_ints`, not copied."""
    memory, shape = shared
    count = int(np.prod(shape))
    return np.frombuffer(memory, dtype=np.int64)[:count].reshape(shape)
