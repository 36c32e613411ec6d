"""Rows of a client's loop on their way to a recording."""

from __future__ import annotations

import struct

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic.errors import LocalProtocolError, RemoteProtocolError
from cohaptic.status.row import COLUMNS, EXACT, ROW
from cohaptic.status.row_batch import MAX_BYTES, MAX_ROWS, Clock, RowBatch

CLOCK = Clock(-12.5, 0.002, 0.004, 0.0005)
times = st.floats(-1e9, 1e9, allow_nan=False)
numbers = st.floats(width=32)


@st.composite
def blocks(draw: st.DrawFn) -> bytes:
    """Rows whose times rise, and whose other numbers are what 32 bits hold."""
    rise = sorted(draw(st.lists(times, min_size=1, max_size=8)))
    rest = [draw(st.lists(numbers, min_size=len(COLUMNS) - 1, max_size=len(COLUMNS) - 1))
            for _ in rise]  # fmt: skip
    return b"".join(ROW.pack(t, *row) for t, row in zip(rise, rest, strict=True))


@given(blocks(), st.integers(0, 2**32 - 1), times)
def test_rows_come_back_as_they_were(block: bytes, lost: int, to_server: float) -> None:
    batch = RowBatch(lost, CLOCK._replace(to_server=to_server), block)
    back = RowBatch.decode(batch.encode())
    assert back.lost == lost
    assert back.clock.to_server == to_server
    assert np.array_equal(np.frombuffer(back.block), np.frombuffer(block), equal_nan=True)


def test_numbers_of_64_bits_are_kept_where_they_mean_something() -> None:
    exact = [1e5 + 1e-6 * (k + 1) if name in EXACT else 1 / 3 for k, name in enumerate(COLUMNS)]
    back = RowBatch.decode(RowBatch(0, CLOCK, ROW.pack(*exact)).encode())
    for name, was, now in zip(COLUMNS, exact, ROW.unpack(back.block), strict=True):
        assert now == (was if name in EXACT else pytest.approx(was, rel=1e-7))


def test_the_version_of_the_protocol_fixes_the_columns() -> None:
    """A new column changes the meaning of the bytes: it needs a new version of the protocol."""
    assert (len(COLUMNS), sorted(EXACT)) == (51, ["reason", "t", "tick"])


ONE = RowBatch(0, CLOCK, ROW.pack(*range(len(COLUMNS)))).encode()


@given(st.binary(max_size=200) | st.integers(0, len(ONE)).map(lambda n: ONE[:n]))
def test_other_bytes_are_an_error_that_names_the_value(data: bytes) -> None:
    if data != ONE:
        with pytest.raises(RemoteProtocolError):
            RowBatch.decode(data)


@given(st.integers(4, len(ONE) - 1), st.integers(1, 255))
def test_a_byte_that_is_wrong_harms_nobody(at: int, by: int) -> None:
    wrong = bytearray(ONE)
    wrong[at] ^= by
    try:
        batch = RowBatch.decode(bytes(wrong))
    except RemoteProtocolError:
        return
    assert 1 <= batch.count <= MAX_ROWS


@pytest.mark.parametrize(
    ("at", "code", "value"),
    [
        (4, "<H", 0),
        (4, "<H", MAX_ROWS + 1),
        (10, "<d", float("nan")),
        (10, "<d", 1e10),
        (18, "<d", -1.0),
        (26, "<f", float("inf")),
        (30, "<f", -0.5),
    ],
)
def test_what_is_out_of_its_range_is_refused(at: int, code: str, value: float) -> None:
    wrong = bytearray(ONE)
    struct.pack_into(code, wrong, at, value)
    with pytest.raises(RemoteProtocolError):
        RowBatch.decode(bytes(wrong))


def test_times_do_not_fall() -> None:
    row = [0.0] * (len(COLUMNS) - 1)
    with pytest.raises(LocalProtocolError, match="t of a row"):
        RowBatch(0, CLOCK, ROW.pack(2.0, *row) + ROW.pack(1.0, *row)).encode()


def test_a_bomb_is_inflated_no_further_than_its_rows() -> None:
    import zlib

    bomb = ONE[:34] + zlib.compress(bytes(50_000_000), 9)
    assert len(bomb) > MAX_BYTES
    with pytest.raises(RemoteProtocolError, match="rows length"):
        RowBatch.decode(bomb)
    with pytest.raises(RemoteProtocolError, match="inflated size of rows"):
        RowBatch.decode(ONE[:34] + zlib.compress(bytes(3_000_000), 9)[:MAX_BYTES])
