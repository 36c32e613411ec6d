"""What signals do to the haptic loop's process: none ends it with force on the hand.

Ctrl-C reaches every process of a terminal, and this one ends when its parent says so. Ctrl-Z would
stop it in the middle of a contact, with the last force on the hand for as long as the terminal
likes: the loop runs on, and lets go when its parent, which has stopped, is silent. Whatever else
would end the process at once ends the loop first. A terminal that closes is no end under `nohup`.
"""

from __future__ import annotations

import signal
from collections.abc import Callable
from typing import Final

_IGNORED: Final = ("SIGINT", "SIGTSTP", "SIGTTIN", "SIGTTOU", "SIGPIPE")
# Those that a process may catch and whose default is to end it, but for the ones that an error of
# the process itself raises (segmentation faults), after which no handler of Python runs.
_ENDING: Final = (
    "SIGTERM", "SIGHUP", "SIGQUIT", "SIGALRM", "SIGVTALRM", "SIGPROF", "SIGUSR1", "SIGUSR2",
    "SIGXCPU", "SIGXFSZ", "SIGIO", "SIGPWR", "SIGSTKFLT", "SIGBREAK",
)  # fmt: skip


def handle_signals(end: Callable[[str], None]) -> None:
    """From now on `end` is called with the name of a signal that would end the process."""

    def ended(number: int, _frame: object) -> None:
        end(signal.Signals(number).name)

    for name in _IGNORED:
        _set(name, signal.SIG_IGN)
    for name in _ENDING:
        if not (name == "SIGHUP" and _under_nohup()):
            _set(name, ended)


def _under_nohup() -> bool:
    number = getattr(signal, "SIGHUP", None)
    return number is not None and signal.getsignal(number) == signal.SIG_IGN


def _set(name: str, handler: Callable[[int, object], None] | signal.Handlers) -> None:
    number = getattr(signal, name, None)  # systems differ in what they have
    if number is not None:
        signal.signal(number, handler)
