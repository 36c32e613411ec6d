"""SIGINT and SIGTERM end every command, however it was started.

A shell without job control (`bash script &`, many service managers) starts what runs in its
background with SIGINT ignored, so that Ctrl-C of the terminal, which goes to a whole group of
processes, ends only the command in front. Python leaves it ignored, and SIGINT sent to that one
process would be lost. Here a signal that reaches a command is meant for it. A command that is to
outlive its terminal is started with `nohup`, whose SIGHUP stays ignored; one that is to outlive
Ctrl-C, in a session of its own (`setsid`).
"""

from __future__ import annotations

import contextlib
import signal
import threading
from collections.abc import Generator


@contextlib.contextmanager
def signals_heeded() -> Generator[None, None, None]:
    """Within the block SIGINT raises KeyboardInterrupt, and SIGTERM does what SIGINT does.

    Both until the block gives them a meaning of its own, which it then keeps. In another thread
    than the main one, which hears no signals, nothing is changed.
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
    # Whatever SIGINT means to the command by now. On Windows `raise_signal` knows it, too.
    signal.raise_signal(signal.SIGINT)
