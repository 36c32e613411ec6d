"""Rows of the haptic loop on their way to a server that records the session. No I/O."""

from __future__ import annotations

from typing import Final

from cohaptic.status.row import ROW
from cohaptic.status.row_batch import MAX_BYTES, MAX_ROWS, Clock, RowBatch

# Rows that wait at most: what a lost connection of 8 s leaves at 1 kHz.
_MOST_WAITING: Final = 8192
# Share of the waiting rows that leave beside one sample: the loop's rows come every 0.1 s at once,
# and are spread over the samples until then, since a burst would hold up the sample behind it.
_SHARE: Final = 6
_LEAST: Final = 16  # rows in a batch; fewer would be mostly heads


class RowsOut:
    """Rows that wait for their batch; the oldest are left out, and counted, if too many wait."""

    def __init__(self) -> None:
        self._waiting = bytearray()
        self._lost = 0

    def keep(self, block: bytes) -> None:
        """Add rows, a block as for `cohaptic.status.row.rows_in`."""
        self._waiting += block
        excess = len(self._waiting) // ROW.size - _MOST_WAITING
        if excess > 0:
            del self._waiting[: excess * ROW.size]
            self._lost += excess

    def lose(self, count: int) -> None:
        """Count rows of batches that did not leave."""
        self._lost += count

    def batches(self, clock: Clock, *, whole: bool = False) -> list[bytes]:
        """Remove rows, and return them as frames, to be sent beside a sample.

        Args:
            clock: The client's clock, as it is known now.
            whole: Whether all rows are to leave, and not their share.
        """
        waiting = len(self._waiting) // ROW.size
        share = waiting if whole else min(waiting, max(_LEAST, -(-waiting // _SHARE)))
        frames = list[bytes]()
        while share > 0:
            frame, count = self._batch(min(share, MAX_ROWS), clock)
            frames.append(frame)
            share -= count
        return frames

    def _batch(self, count: int, clock: Clock) -> tuple[bytes, int]:
        while True:
            block = bytes(self._waiting[: count * ROW.size])
            frame = RowBatch(self._lost, clock, block).encode()
            if len(frame) <= MAX_BYTES:
                break
            count = (count + 1) // 2  # numbers that are all different deflate badly
        del self._waiting[: count * ROW.size]
        self._lost = 0
        return frame, count
