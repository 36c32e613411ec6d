"""A load that has nothing to do with a server.

    python benchmarks/like_load.py SHARE SECONDS NICENESS

It takes that share of a processor by arithmetic and copies of memory in turn, and imports nothing
that would take time beside. It says a line once it begins.
"""

from __future__ import annotations

import os
import sys
import time

_PERIOD = 0.05  # s
_COPIED = 16 * 2**20  # bytes, more than a processor keeps near


def main() -> None:
    """Be the load."""
    fraction, seconds, niceness = map(float, sys.argv[1:])
    os.nice(round(niceness))
    source, copy = bytes(_COPIED), bytearray(_COPIED)
    print("begins", flush=True)
    end, turn = time.monotonic() + seconds, 0
    while time.monotonic() < end:
        until, used = time.monotonic() + _PERIOD, time.process_time()
        while time.monotonic() < until and time.process_time() - used < fraction * _PERIOD:
            turn += 1
            if turn % 2:
                copy[:] = source
            else:
                sum(range(100_000))
        time.sleep(max(0.0, until - time.monotonic()))


if __name__ == "__main__":
    main()
