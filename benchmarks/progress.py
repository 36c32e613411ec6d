"""What a long benchmark is doing, on the standard error: a log of its rows has no such lines."""

from __future__ import annotations

import sys
import time

_BEGIN = time.monotonic()


def spent() -> float:
    """Time since this module was imported [s]."""
    return time.monotonic() - _BEGIN


def say(words: str) -> None:
    """Say it at once, with the time since the beginning."""
    print(f"[{spent():5.0f} s] {words}", file=sys.stderr, flush=True)
