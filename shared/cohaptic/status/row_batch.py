"""Message from client to server while the session is recorded: rows of the haptic loop.

A batch follows a sample and never precedes one; where the link is busy it is left out, and the next
batch says how many rows were. The columns are those of `cohaptic.status.row.Row`, column after
column, since a column deflates to half of what its rows do; all but a few are rounded to 32 bits.
"""

from __future__ import annotations

import sys
import zlib
from array import array
from dataclasses import dataclass
from typing import Final, NamedTuple

from cohaptic.errors import RemoteProtocolError
from cohaptic.protocol.fields import FrameKind
from cohaptic.protocol.frame import HEADER, check_range, open_header, wrong
from cohaptic.protocol.layout import ROWS
from cohaptic.protocol.rest_mesh import inflate
from cohaptic.protocol.version import PROTOCOL_VERSION
from cohaptic.status.row import COLUMNS, EXACT, ROW

MAX_BYTES: Final = 4096  # of the frame; a server takes no longer message
MAX_ROWS: Final = 64
_BODY = ROWS.packer()
_U32 = 2**32 - 1
_MAX_TIME: Final = 1e9  # s; a client's clock counts from its start, or from that of its machine
_WIDTH = len(COLUMNS)
_EXACT = [i for i, name in enumerate(COLUMNS) if name in EXACT]
_NARROW = [i for i, name in enumerate(COLUMNS) if name not in EXACT]
_ROW_BYTES = 8 * len(_EXACT) + 4 * len(_NARROW)
_SWAPS = sys.byteorder == "big"


class Clock(NamedTuple):
    """A client's clock, and the link over which it was compared with the server's.

    Fields:
        to_server: The server's clock less the client's [s].
        error: Bound on its error [s].
        round_trip: Mean round trip [s].
        jitter: Mean deviation from it [s].
    """

    to_server: float
    error: float
    round_trip: float
    jitter: float


@dataclass(frozen=True, slots=True)
class RowBatch:
    """Rows of consecutive periods.

    Args:
        lost: Number of rows since the last batch that were left out.
        clock: The client's clock and its link.
        block: The rows, each 64-bit little-endian numbers in the order of `Row`.
    """

    lost: int
    clock: Clock
    block: bytes

    @property
    def count(self) -> int:
        """Number of rows."""
        return len(self.block) // ROW.size

    def encode(self) -> bytes:
        """The frame of these rows; raises LocalProtocolError when a value is out of its limits."""
        self._check(remote=False)
        numbers = _numbers("d", self.block)
        exact, narrow = array("d"), array("f")
        for i in _EXACT:
            exact.extend(numbers[i::_WIDTH])
        for i in _NARROW:
            narrow.extend(array("f", numbers[i::_WIDTH]))
        head = HEADER.pack(PROTOCOL_VERSION, FrameKind.ROWS, 0)
        body = _BODY.pack(self.count, self.lost, *self.clock)
        # The first level takes a third of the time of the usual one, and 5 % more bytes.
        return head + body + zlib.compress(_bytes(exact) + _bytes(narrow), 1)

    @classmethod
    def decode(cls, data: bytes) -> RowBatch:
        """The rows in a frame; raises RemoteProtocolError for any invalid bytes."""
        open_header(data, FrameKind.ROWS)
        if not ROWS.size <= len(data) <= MAX_BYTES:
            limit = f"from {ROWS.size} to {MAX_BYTES} bytes"
            raise RemoteProtocolError("rows length", len(data), limit, field="length")
        count, lost, *clock = _BODY.unpack_from(data, HEADER.size)
        check_range("count of rows", count, 1, MAX_ROWS, remote=True)
        raw = inflate(data[ROWS.size :], count * _ROW_BYTES, "rows")
        middle = 8 * len(_EXACT) * count
        exact, narrow = _numbers("d", raw[:middle]), _numbers("f", raw[middle:])
        numbers = array("d", bytes(count * ROW.size))
        for k, i in enumerate(_EXACT):
            numbers[i::_WIDTH] = exact[k * count : (k + 1) * count]
        for k, i in enumerate(_NARROW):
            numbers[i::_WIDTH] = array("d", narrow[k * count : (k + 1) * count])
        batch = cls(lost, Clock(*clock), _bytes(numbers))
        batch._check(remote=True)
        return batch

    def _check(self, *, remote: bool) -> None:
        if not self.block or len(self.block) % ROW.size:
            raise wrong("rows", f"{len(self.block)} bytes", "whole rows", remote=remote)
        check_range("count of rows", self.count, 1, MAX_ROWS, remote=remote)
        check_range("lost of rows", self.lost, 0, _U32, remote=remote)
        check_range("to_server of rows", self.clock.to_server, -_MAX_TIME, _MAX_TIME, remote=remote)
        for name, value in zip(Clock._fields[1:], self.clock[1:], strict=True):
            check_range(f"{name} of rows", value, 0.0, _MAX_TIME, remote=remote)
        before = -_MAX_TIME
        for t in _numbers("d", self.block)[::_WIDTH]:
            if not before <= t <= _MAX_TIME:
                raise wrong("t of a row", t, f"from {before:g} to {_MAX_TIME:g}", remote=remote)
            before = t


def _numbers(code: str, data: bytes) -> array[float]:
    numbers: array[float] = array(code, data)
    if _SWAPS:
        numbers.byteswap()
    return numbers


def _bytes(numbers: array[float]) -> bytes:
    if _SWAPS:
        numbers = numbers[:]
        numbers.byteswap()
    return numbers.tobytes()
