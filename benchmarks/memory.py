"""How fast this machine reads memory: the floor under whatever reads columns.

    python benchmarks/memory.py

The product of an array with itself reads each byte once and keeps nothing. It runs on one thread,
as a tick does, and again and again over the same bytes: what fits a cache comes from there, as the
columns of a hand at rest do. The best of several is the floor: the rest is other programs.
"""

from __future__ import annotations

import math
import time
from typing import Any

import numpy as np
import numpy.typing as npt
from threadpoolctl import threadpool_limits


def read_time(count: int, dtype: npt.DTypeLike = np.float32, repeats: int = 9) -> float:
    """Least time to read `count` bytes once, as numbers of type `dtype` [s]."""
    values: npt.NDArray[Any] = np.ones(max(1, count // np.dtype(dtype).itemsize), dtype=dtype)
    best = math.inf
    for _ in range(repeats):
        start = time.perf_counter()
        np.dot(values, values)
        best = min(best, time.perf_counter() - start)
    return best


def main() -> None:
    """Print a table."""
    print("| bytes read | float32 | float64 |\n|---|---|---|")
    with threadpool_limits(limits=1):
        for megabytes in (1, 4, 16, 64, 256):
            count = megabytes * 10**6
            rates = [1e-9 * count / read_time(count, dtype) for dtype in (np.float32, np.float64)]
            print(f"| {megabytes} MB | {rates[0]:.1f} GB/s | {rates[1]:.1f} GB/s |")


if __name__ == "__main__":
    main()
