"""Make SIGINT and SIGTERM end every command, however the command was started.

A shell without job control (`bash script &`, many service managers) starts background commands with
SIGINT ignored, so that Ctrl-C of the terminal, which goes to a whole process group, ends only the
foreground command. Python leaves SIGINT ignored, and a SIGINT sent to that one process would be
lost. This module takes every signal that reaches a command as meant for that command. To outlive
its terminal, a command is started with `nohup`, and SIGHUP stays ignored; to outlive Ctrl-C, a
command is started in a session of its own (`setsid`).
"""

from __future__ import annotations

import contextlib
import signal
import threading
from collections.abc import Generator


@contextlib.contextmanager
def signals_heeded() -> Generator[None, None, None]:
    """Within the block, let SIGINT raise KeyboardInterrupt, and SIGTERM do what SIGINT does.

    A handler that code within the block installs stays in place afterwards. Outside the main
    thread, where Python handles no signals, nothing is changed.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    ours: dict[signal.Signals, object] = {}
    if before[signal.SIGINT] is signal.SIG_IGN:
        ours[signal.SIGINT] = signal.default_int_handler
        signal.signal(signal.SIGINT, signal.default_int_handler)
    if before[signal.SIGTERM] in (signal.SIG_DFL, signal.SIG_IGN):
        ours[signal.SIGTERM] = _as_interrupt
        signal.signal(signal.SIGTERM, _as_interrupt)
    try:
        yield
    finally:
        for number, handler in ours.items():
            if signal.getsignal(number) is handler:
                signal.signal(number, before[number])


def _as_interrupt(_number: int, _frame: object) -> None:
    # Do what SIGINT means to the command by now. On Windows `raise_signal` knows SIGINT, too.
    signal.raise_signal(signal.SIGINT)
