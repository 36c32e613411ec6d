"""Rate at which this machine reads memory: a lower bound for every tick that reads columns.

    python benchmarks/memory.py [--json FILE]

The product of an array with itself reads each byte once and keeps nothing. It runs on one thread,
as a tick does, repeatedly over the same bytes: those that fit into a cache are read from it, as the
columns of a hand at rest are. The best of several runs counts; the others include other programs.
"""

from __future__ import annotations

import math
import time
from typing import Any

import numpy as np
import numpy.typing as npt
from threadpoolctl import threadpool_limits

import json_report


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
    options = json_report.parser(__doc__).parse_args()
    results: list[json_report.Result] = []
    print("| bytes read | float32 | float64 |\n|---|---|---|")
    with threadpool_limits(limits=1):
        for megabytes in (1, 4, 16, 64, 256):
            count = megabytes * 10**6
            rates = [1e-9 * count / read_time(count, dtype) for dtype in (np.float32, np.float64)]
            print(f"| {megabytes} MB | {rates[0]:.1f} GB/s | {rates[1]:.1f} GB/s |")
            results.append(
                {
                    "bytes": count,
                    "float32_bytes_per_s": 1e9 * rates[0],
                    "float64_bytes_per_s": 1e9 * rates[1],
                }
            )
    json_report.write(options, results)


if __name__ == "__main__":
    main()
