"""SIGHUP to a server: its terminal has closed, or somebody wants its files to be read again.

Both come as the same signal. Where one of the standard streams is a terminal that has gone, it is
the first, which ends a server as SIGTERM does: nobody could see it any more, or end it by Ctrl-C.
"""

from __future__ import annotations

import contextlib
import os
import select
import signal
import stat
from collections.abc import Callable


def terminal_has_gone() -> bool:
    """Whether this process was given a terminal, and it has closed since."""
    if not hasattr(select, "poll"):
        return False
    streams = select.poll()
    for file in range(3):
        with contextlib.suppress(OSError):  # it is closed
            if stat.S_ISCHR(os.fstat(file).st_mode):
                streams.register(file, 0)  # what has hung up is told in any case
    return any(event & select.POLLHUP for _, event in streams.poll(0))


def on_hangup(again: Callable[[], None]) -> Callable[[], None]:
    """What to do when SIGHUP comes: end as by SIGTERM, or read files again.

    Under `nohup`, where it is ignored until then, it ends nothing.

    Args:
        again: Called to read them.
    """
    hangup = getattr(signal, "SIGHUP", None)  # Windows has none
    stays = hangup is not None and signal.getsignal(hangup) is signal.SIG_IGN

    def heard() -> None:
        if not stays and terminal_has_gone():
            signal.raise_signal(signal.SIGTERM)
        else:
            again()

    return heard
