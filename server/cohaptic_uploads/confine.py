"""Limits that a process sets itself before it reads a stranger's file.

Linux keeps the memory by itself: an allocation beyond the limit fails. Elsewhere a thread looks at
the peak ten times a second and ends the process. No limit of these can be lifted again: they are
hard ones, and the process has no rights to raise them unless it runs as root.
"""

from __future__ import annotations

import ctypes
import os
import sys
import threading
from typing import Any

from cohaptic.runtime.scheduling import stand_back
from cohaptic_server.process_memory import own_peak

TOO_MUCH_MEMORY = 86  # exit status of a process that the thread has ended
_LOOK_EVERY = 0.1  # s


def confine(memory: int, cpu: float, file: int) -> None:
    """Limit this process.

    Args:
        memory: Largest use of memory; on Linux of address space [bytes].
        cpu: Processor time [s].
        file: Largest file that it may write [bytes].
    """
    stand_back()
    if sys.platform != "win32":
        import resource

        seconds = max(1, round(cpu))
        # Beyond the first it is told, beyond the second ended.
        resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds + 2))
        resource.setrlimit(resource.RLIMIT_FSIZE, (file, file))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        if sys.platform == "linux":
            resource.setrlimit(resource.RLIMIT_AS, (memory, memory))
            _die_with_the_server()
            return
    threading.Thread(target=watch, args=(memory,), name="watch", daemon=True).start()


def watch(memory: int) -> None:
    """End this process once its peak is above a limit; returns never."""
    pause = threading.Event()
    while True:
        if own_peak() > memory:
            os._exit(TOO_MUCH_MEMORY)
        pause.wait(_LOOK_EVERY)


def _die_with_the_server() -> None:
    """On Linux: be killed when the thread that started this process ends."""
    prctl_set_pdeathsig, sigkill = 1, 9
    before = os.getppid()
    libc: Any = ctypes.CDLL(None)
    libc.prctl(prctl_set_pdeathsig, ctypes.c_ulong(sigkill), 0, 0, 0)
    if os.getppid() != before:
        os._exit(1)
