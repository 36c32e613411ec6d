"""Collects the rows of the loop in memory, and writes them to a file at the end."""

from __future__ import annotations

import contextlib
from collections import deque
from pathlib import Path

from cohaptic.errors import SettingError
from cohaptic.status.row import COLUMNS, ROW
from cohaptic.vec import ZERO, Vec3

MAX_SECONDS = 300.0  # older rows are dropped, so that a long recording needs bounded memory


class Recorder:
    """Collects the rows of the loop's last `MAX_SECONDS`; older rows are dropped.

    Args:
        loop_hz: Rows per second [Hz].
    """

    def __init__(self, loop_hz: float) -> None:
        self._most = int(MAX_SECONDS * loop_hz) * ROW.size  # bytes
        self._blocks: deque[tuple[bytes, Vec3]] = deque()
        self._size = 0

    def keep(self, rows: bytes, origin: Vec3 = ZERO) -> None:
        """Add a block of rows, as bytes of `cohaptic.status.row.ROW`.

        Args:
            origin: Origin of the rows' frame, as a point of the scaled file of the object [m].
        """
        self._blocks.append((rows, origin))
        self._size += len(rows)
        while self._size - len(self._blocks[0][0]) >= self._most:
            self._size -= len(self._blocks.popleft()[0])

    def save(self, path: Path, *, name: str, to_wall: float) -> None:
        """Write a `.npz`: `columns` (names), `rows` (n, columns), `name`, `to_wall`, `origin`.

        `origin` (n, 3) is that of each row, since the object may change in a recording. The time
        `t` of a row plus `to_wall` is Unix time, so that recordings made on one machine can be laid
        side by side.

        Args:
            name: Name of the user.
            to_wall: Unix time less the client's clock [s].

        Raises:
            SettingError: The file cannot be written, as on a full disk; no part of it remains.
        """
        import numpy as np  # only here, so that a client without a recording starts faster

        whole = b"".join(rows for rows, _ in self._blocks)
        rows = np.frombuffer(whole[-self._most :]).reshape(-1, len(COLUMNS))
        counts = [len(block) // ROW.size for block, _ in self._blocks]
        points = np.array([point for _, point in self._blocks]).reshape(-1, 3)
        origin = np.repeat(points, counts, axis=0)[-len(rows) :] if len(rows) else points[:0]
        columns = np.array(COLUMNS)
        if path.suffix != ".npz":  # as numpy does; an error below must remove that file
            path = path.with_name(f"{path.name}.npz")
        try:
            np.savez_compressed(
                path, columns=columns, rows=rows, name=name, to_wall=to_wall, origin=origin
            )
        except OSError as error:
            with contextlib.suppress(OSError):
                path.unlink()
            limit = f"a file that can be written ({error.strerror or error})"
            raise SettingError("--record", path, limit) from error
