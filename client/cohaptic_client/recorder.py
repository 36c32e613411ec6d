"""Keeps the rows of the loop, for a file at the end."""

from __future__ import annotations

import contextlib
from collections import deque
from pathlib import Path

from cohaptic.errors import SettingError
from cohaptic.status.row import COLUMNS, ROW

MAX_SECONDS = 300.0  # older rows are given up: a recording of any length has bounded memory


class Recorder:
    """The last `MAX_SECONDS` of rows.

    Args:
        loop_hz: Rows per second.
    """

    def __init__(self, loop_hz: float) -> None:
        self._most = int(MAX_SECONDS * loop_hz) * ROW.size  # bytes
        self._blocks: deque[bytes] = deque()
        self._size = 0

    def keep(self, rows: bytes) -> None:
        """Add a block of rows."""
        self._blocks.append(rows)
        self._size += len(rows)
        while self._size - len(self._blocks[0]) >= self._most:
            self._size -= len(self._blocks.popleft())

    def save(self, path: Path, *, name: str, to_wall: float) -> None:
        """Write a `.npz`: `columns` (names), `rows` (n, columns), `name`, `to_wall` [s].

        `t + to_wall` is Unix time, so that recordings made on one machine can be laid side by side.

        Raises:
            SettingError: It cannot be written, such as on a full disk; nothing stays there.
        """
        import numpy as np  # only here: a client that records nothing starts without it

        rows = np.frombuffer(b"".join(self._blocks)[-self._most :]).reshape(-1, len(COLUMNS))
        columns = np.array(COLUMNS)
        if path.suffix != ".npz":  # as numpy does by itself: what is removed below is this file
            path = path.with_name(f"{path.name}.npz")
        try:
            np.savez_compressed(path, columns=columns, rows=rows, name=name, to_wall=to_wall)
        except OSError as error:
            with contextlib.suppress(OSError):
                path.unlink()
            limit = f"a file that can be written ({error.strerror or error})"
            raise SettingError("--record", path, limit) from error
