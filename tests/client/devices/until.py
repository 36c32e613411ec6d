"""Waiting for another thread or process."""

from __future__ import annotations

import threading
from collections.abc import Callable

from cohaptic.clock import SystemClock

_CLOCK = SystemClock()


def until(condition: Callable[[], bool], seconds: float = 20.0) -> None:
    """Wait until `condition` holds; a machine that is busy with other tests takes its time."""
    end = _CLOCK.now() + seconds
    while not condition():
        if _CLOCK.now() > end:
            raise TimeoutError("what a test waits for does not happen")
        threading.Event().wait(0.001)
