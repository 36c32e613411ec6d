"""Set the scheduling of processes and lock memory; no function raises if the system refuses."""

from __future__ import annotations

import contextlib
import ctypes
import math
import os
import sys
from typing import Any

# Low real-time priorities: above every ordinary process, below the system's own. The haptic loop
# has the higher one, since a late period is felt at once.
LOOP_PRIORITY = 5
SERVER_PRIORITY = 2
LOW_NICENESS = 10


def prefer_this_process(priority: int) -> str:
    """Give this process the most punctual scheduling that the system allows.

    Args:
        priority: Real-time priority, where the system has one; the higher priority runs first.

    Returns:
        The scheduling that was granted, in words for a user.
    """
    if sys.platform == "linux":
        return _linux(priority)
    if sys.platform == "win32":
        return _windows()
    return _niceness()


def lock_memory() -> str:
    """Lock this process's memory against swapping, because reading a page takes several periods.

    Returns:
        Whether the memory is locked, in words for a user.
    """
    if sys.platform != "linux":
        return "memory not locked"
    # Flags of mlockall(2); with the last one the system locks a page when it is first used.
    current, future, on_fault = 1, 2, 4
    # Under a limit, later requests for memory could fail because that memory would be locked.
    flags = current | on_fault | (future if memory_lock_limit() == math.inf else 0)
    try:
        libc: Any = ctypes.CDLL(None, use_errno=True)
        if libc.mlockall(flags) == 0:
            return "memory locked"
        reason = os.strerror(ctypes.get_errno())
    except (OSError, AttributeError) as error:
        reason = str(error)
    return f"memory not locked ({reason})"


def memory_lock_limit() -> float:
    """Return how much memory this process may lock [bytes]; inf without a limit, 0 on Windows."""
    if sys.platform == "win32":
        return 0.0
    import resource

    if os.geteuid() == 0:
        return math.inf
    soft, _ = resource.getrlimit(resource.RLIMIT_MEMLOCK)
    return math.inf if soft == resource.RLIM_INFINITY else float(soft)


def be_ordinary() -> None:
    """Give up the real-time priority that `prefer_this_process` set.

    The function changes the calling thread and the threads that it starts from now on. It has an
    effect on Linux only, since no priority of other systems blocks other processes for good.
    """
    if sys.platform == "linux":
        with contextlib.suppress(OSError):
            os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))


def stand_back(pid: int = 0) -> None:
    """Lower the priority of a process below that of ordinary processes, if the system allows it.

    A process inherits the priority of the thread that starts it, even a real-time one. The parent
    should call this function right after the start, because the child itself would first import
    modules for seconds.

    Args:
        pid: Number of the process; 0 for this process. Has no effect on Windows.
    """
    if sys.platform == "linux":
        with contextlib.suppress(OSError):
            os.sched_setscheduler(pid, os.SCHED_OTHER, os.sched_param(0))
    if sys.platform != "win32":
        with contextlib.suppress(OSError):
            os.setpriority(os.PRIO_PROCESS, pid, LOW_NICENESS)


def _linux(priority: int) -> str:
    # Sleep without the 50 us of timer slack that a normal thread has.
    prctl_set_timerslack = 29
    try:
        libc: Any = ctypes.CDLL(None)
        libc.prctl(prctl_set_timerslack, ctypes.c_ulong(1), 0, 0, 0)
    except (OSError, AttributeError):
        pass
    if sys.platform == "linux":
        try:
            os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(priority))
            return f"real-time (SCHED_FIFO {priority})"
        except OSError:
            pass
    return _niceness()


def _windows() -> str:
    if sys.platform == "win32":
        high_priority_class = 0x80
        kernel: Any = ctypes.windll.kernel32
        ctypes.windll.winmm.timeBeginPeriod(1)
        if kernel.SetPriorityClass(kernel.GetCurrentProcess(), high_priority_class):
            return "high priority class, 1 ms timer"
    return "normal"


def _niceness() -> str:
    if sys.platform != "win32":
        try:
            return f"nice {os.nice(-10)}"
        except OSError:
            pass
    return "normal"
