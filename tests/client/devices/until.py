"""Waiting for another thread or process, and a clock for who waits."""

from __future__ import annotations

import threading
from collections.abc import Callable

from cohaptic.clock import SystemClock
from tests.patience import PATIENCE

_CLOCK = SystemClock()
_LARGEST = 0.005  # s from one look at a steady clock to the next


class SteadyClock:
    """The time of a test that reads a device: it goes on by 5 ms at most from look to look.

    A driver that is read after a long while takes the force back, and lets it come again in half a
    second. On a busy machine that would happen again and again; it is tested in virtual time.
    """

    def __init__(self) -> None:
        self._time = self._seen = _CLOCK.now()

    def now(self) -> float:
        """Seconds since an origin of its own."""
        seen = _CLOCK.now()
        self._time += min(seen - self._seen, _LARGEST)
        self._seen = seen
        return self._time

    def sleep_until(self, when: float) -> None:
        """Wait as long as it takes on the machine's clock."""
        _CLOCK.sleep_until(_CLOCK.now() + when - self.now())


def until(condition: Callable[[], bool], seconds: float = PATIENCE) -> None:
    """Wait until `condition` holds; a machine that is busy with other tests takes its time."""
    end = _CLOCK.now() + seconds
    while not condition():
        if _CLOCK.now() > end:
            raise TimeoutError("what a test waits for does not happen")
        threading.Event().wait(0.001)
