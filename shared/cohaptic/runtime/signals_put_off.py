"""Delay signals while a command applies force to a hand, so that the device is released first.

A command that gives a force for a moment (a knock, a nudge) has no loop and no second process. A
signal that ended or stopped the command in that moment would leave the force on; a device whose
firmware has no watchdog would keep the force for ever.
"""

from __future__ import annotations

import contextlib
import signal
from collections.abc import Callable, Generator
from typing import Final

# Ctrl-C, Ctrl-Z, `kill` and a closing terminal; Windows has only Ctrl-C and `kill`.
_NAMES: Final = ("SIGINT", "SIGTERM", "SIGHUP", "SIGQUIT", "SIGTSTP")


@contextlib.contextmanager
def signals_put_off() -> Generator[Callable[[], bool], None, None]:
    """Delay signals that come within the block; the first takes effect afterwards, no other does.

    Use it in the main thread only, and for less than a second.

    Yields:
        Function that returns whether a signal has come; the block should then end.
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
