"""Keeps the rows of the loop, for a file at the end."""

from __future__ import annotations

from collections import deque
from pathlib import Path

import numpy as np

from cohaptic.status.row import COLUMNS, Row

MAX_SECONDS = 300.0  # older rows are given up: a recording of any length has bounded memory


class Recorder:
    """The last `MAX_SECONDS` of rows.

    Args:
        loop_hz: Rows per second.
    """

    def __init__(self, loop_hz: float) -> None:
        self._rows: deque[Row] = deque(maxlen=int(MAX_SECONDS * loop_hz))

    def keep(self, rows: list[Row]) -> None:
        """Add rows."""
        self._rows.extend(rows)

    def save(self, path: Path, *, name: str, to_wall: float) -> None:
        """Write a `.npz`: `columns` (names), `rows` (n, columns), `name`, `to_wall` [s].

        `t + to_wall` is Unix time, so that recordings made on one machine can be laid side by side.
        """
        rows = np.array(self._rows, dtype=np.float64).reshape(-1, len(COLUMNS))
        np.savez_compressed(path, columns=np.array(COLUMNS), rows=rows, name=name, to_wall=to_wall)
