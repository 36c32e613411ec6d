"""Ctrl-C ends a block of work wherever it comes, also where Python would forget it."""

from __future__ import annotations

import signal
import sys
import threading
from collections.abc import Callable, Generator
from contextlib import contextmanager


@contextmanager
def interruptible() -> Generator[Callable[[], None], None, None]:
    """Ctrl-C within ends the block with KeyboardInterrupt.

    Python raises it between two lines of whatever runs just then. In a finaliser (`__del__`), in a
    callback from C or of the garbage collector, it is printed and forgotten, and the work would go
    on to its end. Here it is remembered, and raised again by the function that is yielded and at
    the end of the block. Where Ctrl-C means something else already, or in another thread than the
    main one, which hears no signals, nothing is changed.

    Yields:
        A function that the work calls now and then; it raises KeyboardInterrupt once one has come.
    """
    if (
        threading.current_thread() is not threading.main_thread()
        or signal.getsignal(signal.SIGINT) is not signal.default_int_handler
    ):
        yield lambda: None
        return
    came = False

    def note(_number: int, _frame: object) -> None:
        nonlocal came
        came = True
        raise KeyboardInterrupt

    def check() -> None:
        if came:
            raise KeyboardInterrupt

    def told(problem: sys.UnraisableHookArgs) -> None:
        # What is not forgotten needs no traceback either.
        if not isinstance(problem.exc_value, KeyboardInterrupt):
            others(problem)

    others, sys.unraisablehook = sys.unraisablehook, told
    signal.signal(signal.SIGINT, note)
    try:
        yield check
        check()
    except Exception:
        check()  # a child hears of it too, and that it has ended may be what went wrong
        raise
    finally:
        signal.signal(signal.SIGINT, signal.default_int_handler)
        sys.unraisablehook = others
