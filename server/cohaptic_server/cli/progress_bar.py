"""Shows the phases of a long preparation on a terminal; Ctrl-C ends it with one sentence.

Ctrl-C also works while Python runs a callback whose exceptions it ignores.
"""

from __future__ import annotations

import signal
import sys
import threading
from collections.abc import Callable, Generator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskID, TextColumn, TimeElapsedColumn

from cohaptic.clock import SystemClock
from cohaptic.errors import one_line
from cohaptic_server.progress import TimeLeft


@contextmanager
def interruptible() -> Generator[Callable[[], None], None, None]:
    """Context in which Ctrl-C reliably ends the block with KeyboardInterrupt.

    Python raises KeyboardInterrupt in the code that runs at that moment. In a finaliser
    (`__del__`), or in a callback from C or of the garbage collector, Python prints and ignores the
    exception, and the work would go on to its end. This context remembers Ctrl-C: the yielded
    function and the end of the block raise the exception again. The context does nothing if SIGINT
    has another handler already, or in a thread other than the main one, which gets no signals.

    Yields:
        Function that the work must call from time to time; it raises KeyboardInterrupt after a
        Ctrl-C.
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

    def report(problem: sys.UnraisableHookArgs) -> None:
        # An ignored KeyboardInterrupt is raised again later, so that no traceback is printed here.
        if not isinstance(problem.exc_value, KeyboardInterrupt):
            others(problem)

    others, sys.unraisablehook = sys.unraisablehook, report
    signal.signal(signal.SIGINT, note)
    try:
        yield check
        check()
    except Exception:
        check()  # Ctrl-C also ends child processes, which may have caused this error
        raise
    finally:
        signal.signal(signal.SIGINT, signal.default_int_handler)
        sys.unraisablehook = others


INTERRUPTED = (
    "cohaptic: interrupted; what was finished is kept, and the same command goes on from there"
)
_EXIT_STATUS = 130  # of a command that SIGINT has ended: 128 plus the number of the signal


@contextmanager
def progress_bar(title: str) -> Generator[Callable[[str, float], None], None, None]:
    """Show progress bars; yield a function of the current phase and its finished fraction (0 to 1).

    A phase whose fraction is still 0 is shown as pending; later the bar shows the time left, from
    the rate so far. The bars disappear at the end; without a terminal nothing is shown. Ctrl-C ends
    the command with a sentence.

    Args:
        title: Words in front of the name of each phase.
    """
    title = one_line(title)
    console = Console(stderr=True)
    bar = Progress(
        TextColumn("{task.description}", markup=False),  # names of files are no markup
        BarColumn(),
        TextColumn("{task.fields[share]}"),
        TimeElapsedColumn(),
        TextColumn("{task.fields[left]}"),
        console=console,
        transient=True,
        disable=not console.is_terminal,
    )
    clock, tasks = SystemClock(), dict[str, TaskID]()
    left = TimeLeft(0.0)

    def update(phase: str, fraction: float) -> None:
        nonlocal left
        check()
        if phase not in tasks:
            for other in tasks.values():
                bar.update(other, total=1.0, completed=1.0, fraction="", left="")
                bar.stop_task(other)
            tasks[phase] = bar.add_task(f"{title}: {phase}", total=None, fraction="", left="")
            left = TimeLeft(clock.now())
        if fraction > 0.0:
            words = left.words(fraction, clock.now())
            task = tasks[phase]
            bar.update(task, total=1.0, completed=fraction, fraction=f"{fraction:.0%}", left=words)

    try:
        with interruptible() as check, bar:
            yield update
    except KeyboardInterrupt:
        print(INTERRUPTED, file=sys.stderr)
        raise SystemExit(_EXIT_STATUS) from None
