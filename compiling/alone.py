"""One build of a checkout at a time: each deletes in the end what it does not know."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Generator
from pathlib import Path

from compiling.build import folder


@contextlib.contextmanager
def alone(root: Path) -> Generator[None, None, None]:
    """Wait until no other process builds the same checkout for the same Python, and say so.

    The system ends it with the process, however that ends. Windows has no such lock.

    Args:
        root: The checkout.
    """
    if sys.platform == "win32":
        yield
        return
    import fcntl

    path = folder(root).with_suffix(".lock")
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("w") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            print("waiting for another process that compiles this checkout", flush=True)
            fcntl.flock(file, fcntl.LOCK_EX)
        yield
