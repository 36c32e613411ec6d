"""Command `cohaptic export`: a recorded session as files of other programs."""

from __future__ import annotations

import sys
from collections.abc import Callable, Generator
from contextlib import contextmanager
from enum import Enum
from pathlib import Path
from typing import Annotated

import typer

from cohaptic.cli.session_words import chosen_session
from cohaptic.clock import Clock, SystemClock

_PATIENCE = 2.0  # s after which a person wants to know whether it goes on
_LEAST = 0.05  # s between two states of the line, which a person can read
_REST = "\r\033[K"  # empties the line of a terminal


class To(Enum):
    """What a session can be written as; the values of `cohaptic.sessions.export.FORMS`."""

    PARQUET = "parquet"
    CSV = "csv"
    HDF5 = "hdf5"
    BIDS = "bids"


def export(
    file: Annotated[
        Path,
        typer.Argument(
            help="A session, as `cohaptic serve --record` writes it, or a folder with one."
        ),
    ],
    to: Annotated[
        To,
        typer.Option(
            help="A folder of tables (parquet, csv), one file (hdf5), or a data set of BIDS Motion"
            " (bids)."
        ),
    ] = To.PARQUET,
    out: Annotated[
        Path | None,
        typer.Option(
            help="Folder or file to make, which nothing has the name of yet. Without it the name is"
            " that of the session: lab.mcap becomes lab-parquet, or lab.h5."
        ),
    ] = None,
) -> None:
    """Write a recorded session for other programs, as tables on one clock.

    Nothing is replaced, and what cannot be written to the end leaves nothing behind. What the
    session lacks is told at the end. Needs `pip install "cohaptic[analysis]"`.
    """
    from cohaptic.sessions.export import export_and_tell

    file = chosen_session(file)
    with told(SystemClock(), sys.stderr.isatty(), _write) as progress:
        made, lacks = export_and_tell(file, out or beside(file, to), to.value, progress)
    typer.echo(f"written to {made}")
    if lacks:
        typer.echo(f"cohaptic: {lacks}", err=True)


def beside(file: Path, to: To) -> Path:
    """Return the path beside a session to which it is exported if nobody names one."""
    return file.with_name(f"{file.stem}.h5" if to is To.HDF5 else f"{file.stem}-{to.value}")


@contextmanager
def told(
    clock: Clock, is_terminal: bool, write: Callable[[str], object]
) -> Generator[Callable[[str, float], None], None, None]:
    """Tell the progress of a work in one line that goes away at its end.

    A work of less than two seconds tells nothing, and where there is no terminal nothing is told.

    Args:
        clock: Clock by which the work takes long.
        is_terminal: Whether the line goes to a terminal.
        write: Writes text to the terminal.

    Yields:
        Function of the phase of the work, and of its finished fraction, 0 to 1.
    """
    began, last = clock.now(), 0.0

    def progress(phase: str, fraction: float) -> None:
        nonlocal last
        now = clock.now()
        if is_terminal and now - began > _PATIENCE and now - last > _LEAST:
            last = now
            write(f"{_REST}{phase}: {fraction:.0%}" if fraction > 0.0 else f"{_REST}{phase} ...")

    try:
        yield progress
    finally:
        if last:
            write(_REST)


def _write(text: str) -> None:
    sys.stderr.write(text)
    sys.stderr.flush()
