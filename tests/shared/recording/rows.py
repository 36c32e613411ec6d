"""Rows and recorders for the tests of recordings."""

from __future__ import annotations

from pathlib import Path

from cohaptic.recording.recorder import Recorder
from cohaptic.status.row import COLUMNS, ROW, Row

PERIOD = 0.001  # s


def row(n: int) -> Row:
    """The n-th row, of which no two values are the same."""
    return Row._make((100.0 + n * PERIOD, *(n + column / 100 for column in range(1, len(COLUMNS)))))


def rows(start: int, end: int) -> bytes:
    return b"".join(ROW.pack(*row(n)) for n in range(start, end))


def recorder(path: Path, reported: list[str] | None = None, *, overwrite: bool = False) -> Recorder:
    heard: list[str] = [] if reported is None else reported
    return Recorder(path, name="ann", loop_hz=1000.0, overwrite=overwrite, tell=heard.append)
