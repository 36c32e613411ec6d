"""Signals wait while a command has force on a hand: the device is let go first.

A command that gives a force for a moment (a knock, a nudge) has no loop and no second process. What
would end or stop it in that moment would leave the force there, on a device whose firmware has no
watchdog for ever.
"""

from __future__ import annotations

import contextlib
import signal
from collections.abc import Callable, Generator
from typing import Final

# Ctrl-C, Ctrl-Z, `kill` and a terminal that closes; Windows has the first and the third.
_NAMES: Final = ("SIGINT", "SIGTERM", "SIGHUP", "SIGQUIT", "SIGTSTP")


@contextlib.contextmanager
def signals_put_off() -> Generator[Callable[[], bool], None, None]:
    """Put the signals off that come within; each does afterwards what it would have done.

    For the main thread, and for less than a second.

    Yields:
        Whether one has come, upon which the block should end.
    """
    came: list[int] = []

    def note(number: int, _frame: object) -> None:
        came.append(number)

    numbers = [getattr(signal, name) for name in _NAMES if hasattr(signal, name)]
    before = {number: signal.signal(number, note) for number in numbers}
    try:
        yield lambda: bool(came)
    finally:
        for number, handler in before.items():
            signal.signal(number, handler if handler is not None else signal.SIG_DFL)
        for number in came[:1]:
            signal.raise_signal(number)
