"""The most memory that this command has taken, as the system counts it."""

from __future__ import annotations

import re
import sys
from pathlib import Path

_STATUS = Path("/proc/self/status")


def peak_memory() -> float | None:
    """Largest resident memory of this process so far, or of one that it waited for [bytes].

    None on Windows, which does not say.
    """
    if sys.platform == "win32":
        return None
    import resource

    unit = 1 if sys.platform == "darwin" else 1024
    others = unit * resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss
    own = unit * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    if _STATUS.exists():
        # On Linux `ru_maxrss` begins with the memory of the program that started this one.
        found = re.search(r"VmHWM:\s*(\d+) kB", _STATUS.read_text())
        own = own if found is None else 1024 * int(found[1])
    return float(max(own, others))
