"""The time-out of a test, told apart from a law that does not hold.

pytest-timeout raises what hypothesis takes for a counterexample: it would go on to look for a
smaller one, without a limit, and a test that is slow or stands still would never end.
"""

from __future__ import annotations

import signal
from typing import Protocol

import pytest
from _pytest.outcomes import OutcomeException


class TimeOutSettings(Protocol):
    """The part of pytest-timeout's settings that is used here."""

    timeout: float


class TimedOut(OutcomeException):
    """What pytest takes for the end of a test or fixture; hypothesis catches `Failed` alone."""


@pytest.hookimpl(tryfirst=True)
def pytest_timeout_set_timer(item: pytest.Item, settings: TimeOutSettings) -> bool | None:
    """Set the timer of one test; pytest-timeout's own where the system has no such signal."""
    if not hasattr(signal, "setitimer"):
        return None

    def ring(*_: object) -> None:
        raise TimedOut(f"{item.nodeid} took longer than {settings.timeout:g} s")

    def cancel() -> None:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, signal.SIG_DFL)

    item.cancel_timeout = cancel  # type: ignore[attr-defined]  # called by pytest-timeout
    signal.signal(signal.SIGALRM, ring)
    signal.setitimer(signal.ITIMER_REAL, settings.timeout)
    return True
