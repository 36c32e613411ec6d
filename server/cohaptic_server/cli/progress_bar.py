"""Shows the phases of a long preparation on a terminal, and ends it in one sentence on Ctrl-C."""

from __future__ import annotations

import sys
from collections.abc import Callable, Generator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskID, TextColumn, TimeElapsedColumn

from cohaptic.clock import SystemClock
from cohaptic_server.cli.interruptible import interruptible
from cohaptic_server.progress import TimeLeft

INTERRUPTED = (
    "cohaptic: interrupted; what was finished is kept, and the same command goes on from there"
)
_EXIT_STATUS = 130  # of a command that SIGINT ended: 128 and the signal's number


@contextmanager
def progress_bar(title: str) -> Generator[Callable[[str, float], None], None, None]:
    """A function to call with the current phase and the share of it that is done, from 0 to 1.

    A phase without a share is shown as pending; one with a share has the time that is left of it
    beside it, by the rate so far. The bars disappear at the end; without a terminal nothing is
    shown. Ctrl-C ends the command with a sentence.

    Args:
        title: Words in front of each phase.
    """
    console = Console(stderr=True)
    bar = Progress(
        TextColumn("{task.description}"),
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

    def update(phase: str, share: float) -> None:
        nonlocal left
        check()
        if phase not in tasks:
            for other in tasks.values():
                bar.update(other, total=1.0, completed=1.0, share="", left="")
                bar.stop_task(other)
            tasks[phase] = bar.add_task(f"{title}: {phase}", total=None, share="", left="")
            left = TimeLeft(clock.now())
        if share > 0.0:
            words = left.words(share, clock.now())
            task = tasks[phase]
            bar.update(task, total=1.0, completed=share, share=f"{share:.0%}", left=words)

    try:
        with interruptible() as check, bar:
            yield update
    except KeyboardInterrupt:
        print(INTERRUPTED, file=sys.stderr)
        raise SystemExit(_EXIT_STATUS) from None
