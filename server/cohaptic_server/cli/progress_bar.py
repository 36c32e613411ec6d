"""Shows the phases of a long preparation on a terminal."""

from __future__ import annotations

from collections.abc import Callable, Generator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskID, TextColumn, TimeElapsedColumn


@contextmanager
def progress_bar(title: str) -> Generator[Callable[[str, float], None], None, None]:
    """A function to call with the current phase and the share of it that is done, from 0 to 1.

    A phase without a share is shown as pending. The bars disappear at the end; without a terminal
    nothing is shown.

    Args:
        title: Words in front of each phase.
    """
    console = Console(stderr=True)
    bar = Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.fields[share]}"),
        TimeElapsedColumn(),
        console=console,
        transient=True,
        disable=not console.is_terminal,
    )
    tasks: dict[str, TaskID] = {}

    def update(phase: str, share: float) -> None:
        if phase not in tasks:
            for other in tasks.values():
                bar.update(other, total=1.0, completed=1.0, share="")
                bar.stop_task(other)
            tasks[phase] = bar.add_task(f"{title}: {phase}", total=None, share="")
        if share > 0.0:
            bar.update(tasks[phase], total=1.0, completed=share, share=f"{share:.0%}")

    with bar:
        yield update
