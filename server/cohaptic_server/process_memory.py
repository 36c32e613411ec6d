"""Measures the peak memory of this process, and returns free memory to the system."""

from __future__ import annotations

import ctypes
import gc
import re
import sys
from pathlib import Path
from typing import Any

_STATUS = Path("/proc/self/status")


def peak_memory() -> int:
    """Return the peak memory of this process or of an ended child process [bytes].

    The larger of both peaks counts; on Windows child processes do not count.
    """
    if sys.platform == "win32":
        return own_peak()
    import resource

    return max(own_peak(), _unit() * resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)


def own_peak() -> int:
    """Return the peak memory of this process [bytes]: resident, or committed on Windows."""
    if sys.platform == "win32":
        return _windows_peak()
    import resource

    if _STATUS.exists():
        # On Linux `ru_maxrss` begins with the memory of the program that started this one.
        found = re.search(r"VmHWM:\s*(\d+) kB", _STATUS.read_text())
        if found is not None:
            return 1024 * int(found[1])
    return _unit() * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


def keep_what_there_is(*, anew: bool = False) -> None:
    """Exempt all objects that exist now from garbage collection, whose scans would delay ticks.

    In a forked process, a scan would also copy every memory page that the process shares with
    others.

    Args:
        anew: Whether to end earlier exemptions first, so that garbage among the objects exempted
            before is collected, too.
    """
    if anew:
        gc.unfreeze()
    gc.collect()
    gc.freeze()


def give_back() -> None:
    """Return freed memory to the system if the C library (glibc) keeps it.

    Glibc keeps freed memory below a block that is still in use: up to 0.7 GB after an object file
    was examined and its stiffness matrix assembled. A factorisation would need that memory again.
    """
    if sys.platform == "linux":
        trim = getattr(ctypes.CDLL(None), "malloc_trim", None)
        if trim is not None:
            trim(0)


def _unit() -> int:
    """Return the size of the unit of `ru_maxrss` [bytes]: 1 on macOS, otherwise 1024."""
    return 1 if sys.platform == "darwin" else 1024


def _windows_peak() -> int:
    """Return the peak of committed memory (PeakPagefileUsage of Windows) [bytes]."""
    if sys.platform == "win32":

        class Counters(ctypes.Structure):
            _fields_ = [
                ("cb", ctypes.c_ulong),
                ("page_faults", ctypes.c_ulong),
                *((f"size{k}", ctypes.c_size_t) for k in range(8)),
            ]

        counters = Counters()
        counters.cb = ctypes.sizeof(Counters)
        kernel: Any = ctypes.windll.kernel32
        kernel.GetCurrentProcess.restype = ctypes.c_void_p
        handle = ctypes.c_void_p(kernel.GetCurrentProcess())
        if kernel.K32GetProcessMemoryInfo(handle, ctypes.byref(counters), counters.cb):
            return int(counters.size7)
    return 0
