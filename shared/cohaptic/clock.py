"""Clocks; no other module reads the time."""

from __future__ import annotations

import random
import time
from typing import Final, Protocol

_read: Final = time.perf_counter  # bound once: looking it up takes longer than reading the clock
_sleep: Final = time.sleep


class Clock(Protocol):
    """A monotonic clock that code can read and wait on; its origin is arbitrary."""

    def now(self) -> float:
        """Return the time since this clock's origin [s]."""
        ...

    def sleep_until(self, when: float) -> None:
        """Block until this clock reads `when` [s]; return at once if that time has passed."""
        ...


def resolution() -> float:
    """Return the resolution that the machine reports for its monotonic clock [s]."""
    return time.get_clock_info("perf_counter").resolution


def thread_time() -> float:
    """Return the processor time that this thread has taken, from an arbitrary origin on [s]."""
    return time.thread_time()


class SystemClock:
    """The machine's monotonic clock with a random origin.

    The origin differs in every process, so that a time stamp of another process's clock is off by
    hours and the mistake is noticed at once. A process may pass its origin to a child process so
    that both clocks agree.

    Args:
        origin: Origin of another `SystemClock` of this machine [s]; random when None.
    """

    def __init__(self, origin: float | None = None) -> None:
        self.origin = random.uniform(1e4, 2e5) if origin is None else origin

    def now(self) -> float:
        """Return the time since this clock's origin [s]."""
        return _read() + self.origin

    def sleep_until(self, when: float) -> None:
        """Block until this clock reads `when` [s]; return at once if that time has passed."""
        wait = when - self.now()
        if wait > 0:
            _sleep(wait)

    def to_wall(self) -> float:
        """Return the offset to the machine's wall clock [s]: `now() + to_wall()` is Unix time.

        Use this offset only to align recordings of several processes on one machine.
        """
        return time.time() - self.now()
