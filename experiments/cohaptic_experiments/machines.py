"""Computes the parts of an experiment on all machines of a cluster, or on this one alone."""

from __future__ import annotations

import contextlib
import importlib
import os
import socket
from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator
from functools import partial
from typing import Any, Final, Protocol, TypeVar

from cohaptic.errors import SettingError
from cohaptic.runtime.scheduling import stand_back
from cohaptic_ops.cluster.engine import environment

A = TypeVar("A")
B = TypeVar("B")

_ANSWERS: Final = 5.0  # s for the engine's head to take a connection


class Over(Protocol):
    """Calls a function with each part, and returns the results in the order of the parts.

    Function, parts and results must be picklable, and each result must depend on its part alone.
    """

    def __call__(self, function: Callable[[A], B], parts: Iterable[A]) -> Iterator[B]:
        """Call `function` with each part."""
        ...


def here(function: Callable[[A], B], parts: Iterable[A]) -> Iterator[B]:
    """Compute on this machine, one part after the other."""
    return map(function, parts)


@contextlib.contextmanager
def machines(address: str) -> Generator[Over]:
    """Return `Over` for the machines of a cluster.

    There are as many parts at once as processors, below the priority of rooms. A part whose machine
    is lost is computed again on another.

    Args:
        address: Address of the cluster's engine, HOST:PORT, as of `cohaptic serve --cluster`; this
            machine has to be one of it. Empty for this machine alone.

    Raises:
        SettingError: The engine is not installed, or not there.
    """
    if not address:
        yield here
        return
    os.environ.update(environment(os.environ))
    try:
        ray: Any = importlib.import_module("ray")
    except ImportError as error:
        limit = "used with the extra: pip install 'cohaptic[cluster]'"
        raise SettingError("--cluster", address, limit) from error
    host, _, port = address.rpartition(":")
    try:
        with socket.create_connection((host.strip("[]"), int(port)), _ANSWERS):
            pass  # Ray itself would try for minutes
        ray.init(
            address=address, log_to_driver=False, logging_level="ERROR", configure_logging=False
        )
    except (OSError, RuntimeError, ValueError, ray.exceptions.RayError) as error:
        limit = f"HOST:PORT of the engine of a cluster to which this machine belongs ({error})"
        raise SettingError("--cluster", address, limit) from error
    try:
        yield partial(_over, ray)
    finally:
        ray.shutdown()


def _over(ray: Any, function: Callable[[A], B], parts: Iterable[A]) -> Iterator[B]:
    # Processors that the engine has given to rooms are not counted: a room must not wait for parts.
    task = ray.remote(num_cpus=0, scheduling_strategy="SPREAD")(_with_one_core)
    limit = max(1, round(ray.cluster_resources().get("CPU", 1.0)))
    waiting, running = deque[Any](), list[Any]()
    for part in parts:
        if len(running) == limit:
            _, running = ray.wait(running)
        running.append(task.remote(function, part))
        waiting.append(running[-1])
        while waiting[0] not in running:
            yield ray.get(waiting.popleft())
    while waiting:
        yield ray.get(waiting.popleft())


def _with_one_core(function: Callable[[A], B], part: A) -> B:
    """Call a function in a process of the engine, on one processor."""
    import numba  # compiled loops would run on all processors of the machine

    stand_back()
    numba.set_num_threads(1)
    return function(part)
