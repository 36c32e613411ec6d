"""Handle SIGHUP in a server: its terminal closed, or an administrator wants files read again.

Both cases send the same signal. If a standard stream is a terminal that has closed, SIGHUP ends the
server as SIGTERM does, because nobody could see the server or end it by Ctrl-C any more.
"""

from __future__ import annotations

import contextlib
import os
import select
import signal
import stat
from collections.abc import Callable


def terminal_has_gone() -> bool:
    """Whether a standard stream of this process is a terminal that has closed."""
    if not hasattr(select, "poll"):
        return False
    streams = select.poll()
    for file in range(3):
        with contextlib.suppress(OSError):  # the stream is closed
            if stat.S_ISCHR(os.fstat(file).st_mode):
                streams.register(file, 0)  # poll reports a hang-up in any case
    return any(event & select.POLLHUP for _, event in streams.poll(0))


def on_hangup(again: Callable[[], None]) -> Callable[[], None]:
    """Make a handler of SIGHUP that ends the process as SIGTERM does, or reads files again.

    The handler never ends the process if SIGHUP is ignored when this function is called, as under
    `nohup`.

    Args:
        again: Function that reads the files again.
    """
    hangup = getattr(signal, "SIGHUP", None)  # Windows has none
    stays = hangup is not None and signal.getsignal(hangup) is signal.SIG_IGN

    def heard() -> None:
        if not stays and terminal_has_gone():
            signal.raise_signal(signal.SIGTERM)
        else:
            again()

    return heard
