"""The most memory that this command has taken, as the system counts it."""

from __future__ import annotations

import sys


def peak_memory() -> float | None:
    """Largest resident memory of this process so far, or of one that it waited for [bytes].

    None on Windows, which does not say.
    """
    if sys.platform == "win32":
        return None
    import resource

    unit = 1 if sys.platform == "darwin" else 1024
    own, others = (
        resource.getrusage(who).ru_maxrss
        for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)
    )
    return float(unit * max(own, others))
