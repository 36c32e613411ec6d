"""Two independent parts of a computation on two processor cores.

Each part has to spend its time without the global interpreter lock: in compiled kernels, in BLAS.
`both` waits for both parts, and neither part reads what the other writes, so that the results are
bitwise those of a sequential run, in any order and on any core. If the second thread is busy with
something else, the first one does both parts.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from typing import TypeVar

A = TypeVar("A")
B = TypeVar("B")


def cores() -> int:
    """Processor cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def both(first: Callable[[], A], second: Callable[[], B]) -> tuple[A, B]:
    """Results of both functions; an error of either is raised after both have ended."""
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
    """The second thread of this process, started at its first use; None on a single core."""
    return ThreadPoolExecutor(1, "beside") if cores() > 1 else None


# A thread does not survive a fork.
if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_helper.cache_clear)
