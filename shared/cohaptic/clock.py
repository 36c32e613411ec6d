"""Clocks; no other module reads the time."""

from __future__ import annotations

import random
import time
from typing import Final, Protocol

_read: Final = time.perf_counter  # bound once: the look-up takes longer than the reading
_sleep: Final = time.sleep


class Clock(Protocol):
    """A monotonic clock to read and to wait on; its seconds count from an origin of its own."""

    def now(self) -> float:
        """Seconds since this clock's origin."""
        ...

    def sleep_until(self, when: float) -> None:
        """Block until `when` on this clock; return at once if it has passed."""
        ...


def resolution() -> float:
    """Resolution that the machine reports for its monotonic clock [s]."""
    return time.get_clock_info("perf_counter").resolution


class SystemClock:
    """The machine's monotonic clock with a random origin.

    The origin differs in every process: a time stamp from another process's clock is off by hours,
    which shows at once. A process may pass its origin to a child process so that both clocks agree.

    Args:
        origin: Origin of another `SystemClock` of this machine [s]; random when None.
    """

    def __init__(self, origin: float | None = None) -> None:
        self.origin = random.uniform(1e4, 2e5) if origin is None else origin

    def now(self) -> float:
        """Seconds since this clock's origin."""
        return _read() + self.origin

    def sleep_until(self, when: float) -> None:
        """Block until `when` on this clock; return at once if it has passed."""
        wait = when - self.now()
        if wait > 0:
            _sleep(wait)

    def to_wall(self) -> float:
        """Offset to the machine's wall clock [s]: `now() + to_wall()` is Unix time.

        Use the offset only to align recordings of several processes on one machine.
        """
        return time.time() - self.now()
