"""Clocks; no other module reads the time."""

from __future__ import annotations

import random
import time
from typing import Final, Protocol

_read: Final = time.perf_counter  # bound once: the look-up takes longer than the reading
_sleep: Final = time.sleep


class Clock(Protocol):
    """A monotonic clock and a way to wait on it; `now` is in seconds from an origin of its own."""

    def now(self) -> float:
        """Seconds since this clock's origin."""
        ...

    def sleep_until(self, when: float) -> None:
        """Block until `when` on this clock; return at once if it has passed."""
        ...


def resolution() -> float:
    """Smallest step that the machine's monotonic clock can tell, by its own word [s]."""
    return time.get_clock_info("perf_counter").resolution


class SystemClock:
    """The machine's monotonic clock behind a random origin.

    The origin differs in every process, so that a stamp read against the wrong clock is off by
    hours and shows at once. A process may hand its origin to a child of its own to share stamps.

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

        Only for laying recordings of several processes of one machine side by side.
        """
        return time.time() - self.now()
