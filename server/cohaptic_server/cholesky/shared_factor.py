"""A Cholesky factor in single precision in memory that a second process maps instead of copying.

Sending a factor of 1 GB to a process takes seconds and holds it twice. Here its numbers lie in
shared memory; what travels are the few megabytes of indices that say where.
"""

from __future__ import annotations

from multiprocessing.context import SpawnContext
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from cohaptic_server.cholesky.factor import Factor
from cohaptic_server.cholesky.factor_file import from_arrays, to_arrays


class _Block(NamedTuple):
    """Where a dense block lies among the shared numbers.

    Args:
        start: Index of its first number.
        shape: Rows and columns.
        by_columns: Whether its columns, and not its rows, lie together.
    """

    start: int
    shape: tuple[int, int]
    by_columns: bool


class SharedFactor:
    """The numbers of a factor in shared memory; it can be given to a process that is started.

    Args:
        factor: Any precision; its numbers are copied once.
        context: Of the process that shall map them.

    Raises:
        OSError: There is not enough shared memory.
    """

    def __init__(self, factor: Factor, context: SpawnContext) -> None:
        arrays = to_arrays(factor)
        self._indices = {k: a for k, a in arrays.items() if a.dtype.kind != "f"}
        blocks = {k: a for k, a in arrays.items() if a.dtype.kind == "f"}
        self._values = context.RawArray("f", max(1, sum(a.size for a in blocks.values())))
        self._blocks: dict[str, _Block] = {}
        start = 0
        for name, values in blocks.items():
            # LAPACK copies a block that lies the other way round at every solve.
            by_columns = bool(values.flags.f_contiguous and not values.flags.c_contiguous)
            rows, columns = values.shape
            self._blocks[name] = _Block(start, (rows, columns), by_columns)
            self._block(self._blocks[name])[:] = values
            start += values.size

    def factor(self) -> Factor:
        """The factor on the shared numbers, which are not copied."""
        views = {name: self._block(block) for name, block in self._blocks.items()}
        return from_arrays({**self._indices, **views})

    def _block(self, block: _Block) -> npt.NDArray[Any]:
        numbers = np.frombuffer(self._values, dtype=np.float32)
        rows, columns = block.shape
        flat = numbers[block.start : block.start + rows * columns]
        return flat.reshape(block.shape, order="F" if block.by_columns else "C")
