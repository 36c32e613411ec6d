"""Runs two independent parts of a computation on two processor cores.

Both parts have to spend their time without the global interpreter lock: in compiled kernels or in
BLAS. Neither part may read what the other writes; the results are then bitwise the same as in a
sequential run. If the second thread is busy with other work, the first thread computes both parts.
"""

from __future__ import annotations

import contextlib
import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from pathlib import Path
from typing import TypeVar

A = TypeVar("A")
B = TypeVar("B")


def cores() -> int:
    """Number of processor cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def processors(limit: Path = Path("/sys/fs/cgroup/cpu.max")) -> float:
    """Return the number of processors of this machine, or of this container.

    Args:
        limit: File with the container's quota and period, or "max" without a quota.
    """
    with contextlib.suppress(OSError, ValueError):
        quota, period = map(int, limit.read_text().split())
        return min(float(cores()), quota / period)
    return float(cores())


def both(first: Callable[[], A], second: Callable[[], B]) -> tuple[A, B]:
    """Call two functions on two cores, and return both results.

    An error of one function is raised only after the other function has ended.
    """
    helper = _helper()
    if helper is None:
        return first(), second()
    beside = helper.submit(second)
    try:
        one = first()
    except BaseException:
        if not beside.cancel():
            beside.exception()
        raise
    return one, second() if beside.cancel() else beside.result()


@cache
def _helper() -> ThreadPoolExecutor | None:
    """Return the second thread of this process, started at the first call; None on one core."""
    return ThreadPoolExecutor(1, "beside") if cores() > 1 else None


# A thread does not survive a fork.
if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_helper.cache_clear)
