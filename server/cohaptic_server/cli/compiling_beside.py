"""Modules are compiled beside a demonstration, for the next one (docs/decisions/0075).

In a checkout, where there is something to compile and a compiler: both are found out, and the work
is done, by a process of the lowest priority (`compiling/beside.py`), which ends with the
demonstration. Whatever happens to it, the demonstration goes on.
"""

from __future__ import annotations

import contextlib
import os
import sys
import threading
from collections.abc import Callable, Generator
from pathlib import Path

from cohaptic.compiled import PLAIN
from cohaptic_server.demo.processes import DemoFailed, Process

COMPILE = "COHAPTIC_COMPILE"  # 0: never beside a demonstration; `hatch_build.py` knows it too
_CHECKOUT = Path(__file__).parents[3]


@contextlib.contextmanager
def compiling_beside(
    tell: Callable[[str], None], log: Path, checkout: Path = _CHECKOUT
) -> Generator[None, None, None]:
    """Have a process beside the block that compiles what is not compiled.

    Args:
        tell: Called by a thread with one line, if there is something to compile.
        log: File for what the process has to say besides.
        checkout: Where the sources are, if they are there.
    """
    if not _wanted(checkout):
        yield
        return
    try:
        process = Process(log=log, module="compiling.beside", folder=checkout)
    except OSError:
        yield  # no process to be had
        return

    def tell_first() -> None:
        with contextlib.suppress(DemoFailed):  # there is nothing to do
            tell(process.first_line())

    threading.Thread(target=tell_first, daemon=True).start()
    try:
        yield
    finally:
        process.wait()


def _wanted(checkout: Path) -> bool:
    # Windows has no groups of processes that end at one stroke.
    if sys.platform == "win32" or not (checkout / "compiling/beside.py").is_file():
        return False
    return os.environ.get(COMPILE) != "0" and os.environ.get(PLAIN, "0") in ("", "0")
