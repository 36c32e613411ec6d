"""Lets a process limit its own resources before it reads a stranger's file.

Linux enforces the memory limit: an allocation beyond it fails. On other systems a thread reads the
peak memory ten times a second, and ends the process if it exceeds the limit. The limits of the
system are hard limits: the process cannot raise them again unless it runs as root.
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
    """Limit the resources of this process, and lower its priority.

    Args:
        memory: Largest use of memory [bytes]; on Linux the largest address space.
        cpu: Largest processor time [s].
        file: Largest file that the process may write [bytes].
    """
    stand_back()
    if sys.platform != "win32":
        import resource

        seconds = max(1, round(cpu))
        # The system sends a signal at the soft limit and kills the process at the hard limit.
        resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds + 2))
        resource.setrlimit(resource.RLIMIT_FSIZE, (file, file))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        if sys.platform == "linux":
            resource.setrlimit(resource.RLIMIT_AS, (memory, memory))
            _die_with_the_server()
            return
    threading.Thread(target=watch, args=(memory,), name="watch", daemon=True).start()


def watch(memory: int) -> None:
    """End this process as soon as its peak memory exceeds `memory` [bytes]; never returns."""
    pause = threading.Event()
    while True:
        if own_peak() > memory:
            os._exit(TOO_MUCH_MEMORY)
        pause.wait(_LOOK_EVERY)


def _die_with_the_server() -> None:
    """Let Linux kill this process when the thread that started it ends."""
    prctl_set_pdeathsig, sigkill = 1, 9
    before = os.getppid()
    libc: Any = ctypes.CDLL(None)
    libc.prctl(prctl_set_pdeathsig, ctypes.c_ulong(sigkill), 0, 0, 0)
    if os.getppid() != before:
        os._exit(1)
