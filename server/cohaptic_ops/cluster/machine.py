"""Makes this machine a part of the engine: `python -m cohaptic_ops.cluster.machine COMMAND...`.

The command runs until this program's standard input closes, as it does when the server that has
started it ends, or until nothing comes there for a while, as when the server hangs: the engine then
has to learn that no room can be placed here.
"""

from __future__ import annotations

import contextlib
import ctypes
import os
import select
import signal
import subprocess
import sys
import threading
from collections.abc import Sequence
from typing import Final

SILENT: Final = 10.0  # s without a byte from the server, which writes one each second
_PDEATHSIG: Final = 1  # PR_SET_PDEATHSIG of Linux
ENDS_WITHIN: Final = 5.0  # s; the engine tells its head that the machine leaves


def main(command: Sequence[str]) -> int:
    """Run a command until it ends or standard input closes; return its exit status."""
    process = subprocess.Popen(
        command, stdin=subprocess.DEVNULL, start_new_session=True, preexec_fn=_end_with_this
    )

    def watch() -> None:
        source = sys.stdin.fileno()
        while select.select([source], [], [], SILENT)[0] and os.read(source, 4096):
            pass
        # Ray's daemons hear it too: one that is told to end tells its head so, which otherwise
        # misses it after seconds.
        os.killpg(process.pid, signal.SIGTERM)
        with contextlib.suppress(subprocess.TimeoutExpired):
            process.wait(ENDS_WITHIN)
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)

    threading.Thread(target=watch, daemon=True).start()
    status = process.wait()
    with contextlib.suppress(
        ProcessLookupError
    ):  # what it has left would be in the way of the next
        os.killpg(process.pid, signal.SIGKILL)
    return status


def _end_with_this() -> None:
    """Let the kernel tell a child to end when this program is killed (Linux)."""
    with contextlib.suppress(AttributeError, OSError):
        ctypes.CDLL(None).prctl(_PDEATHSIG, signal.SIGTERM)


if __name__ == "__main__":
    os._exit(main(sys.argv[1:]))
