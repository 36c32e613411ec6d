"""A Cholesky factor in single precision in memory that a second process maps instead of copying.

Sending a factor of 1 GB to a process takes seconds and keeps it in memory twice. Here the whole
factor lies in shared memory, and only its place is sent. A new process may be sent only little data
in any case: if it died before it had read all data, the sender would wait for ever.
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
    """A factor in shared memory, as a `FactorReader`.

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
        self.bytes = 4 * count_values(factor)
        copy_values(factor, self._numbers())

    def read(self) -> Factor:
        """Return a factor that uses the shared numbers without a copy."""
        indices = {name: as_ints(shared) for name, shared in self._indices.items()}
        return from_arrays({**indices, "values": self._numbers()})

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
