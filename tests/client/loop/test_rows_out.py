"""Rows on their way to a server that records the session."""

from __future__ import annotations

import random

from hypothesis import given
from hypothesis import strategies as st

from cohaptic.status.row import COLUMNS, ROW
from cohaptic.status.row_batch import MAX_BYTES, Clock, RowBatch
from cohaptic_client.loop.rows_out import RowsOut

CLOCK = Clock(0.0, 0.001, 0.002, 0.0)


def rows(first: int, count: int, rest: list[float] | None = None) -> bytes:
    rest = [0.0] * (len(COLUMNS) - 1) if rest is None else rest
    return b"".join(ROW.pack(float(k), *rest) for k in range(first, first + count))


def of(frames: list[bytes]) -> tuple[list[float], int]:
    """Times of the rows, and how many were lost."""
    batches = [RowBatch.decode(frame) for frame in frames]
    times = [ROW.unpack_from(b.block, k * ROW.size)[0] for b in batches for k in range(b.count)]
    return times, sum(batch.lost for batch in batches)


@given(st.lists(st.integers(0, 400), max_size=12))
def test_every_row_leaves_once_and_in_order(blocks: list[int]) -> None:
    out, frames, made = RowsOut(), list[bytes](), 0
    for count in blocks:
        out.keep(rows(made, count))
        made += count
        frames += out.batches(CLOCK)
    frames += out.batches(CLOCK, whole=True)
    assert of(frames) == ([float(k) for k in range(made)], 0)
    assert all(len(frame) <= MAX_BYTES for frame in frames)


def test_the_rows_of_a_tenth_of_a_second_are_spread_over_the_samples_until_the_next() -> None:
    out = RowsOut()
    out.keep(rows(0, 100))
    sizes = list[int]()
    for _ in range(7):
        sizes += [RowBatch.decode(frame).count for frame in out.batches(CLOCK)]
    assert sum(sizes) == 100
    assert max(sizes) <= 20


@given(st.lists(st.integers(1, 6000), min_size=1, max_size=6), st.integers(0, 50))
def test_of_too_many_the_oldest_are_left_out_and_counted(blocks: list[int], dropped: int) -> None:
    out, made = RowsOut(), 0
    for count in blocks:
        out.keep(rows(made, count))
        made += count
    out.lose(dropped)
    times, lost = of(out.batches(CLOCK, whole=True))
    assert len(times) + lost == made + dropped
    assert times == [float(k) for k in range(made - len(times), made)]


def test_numbers_that_deflate_badly_fit_into_a_frame_too() -> None:
    out, r = RowsOut(), random.Random(1)
    noise = [[r.random() for _ in COLUMNS[1:]] for _ in range(64)]
    out.keep(b"".join(rows(k, 1, rest) for k, rest in enumerate(noise)))
    frames = out.batches(CLOCK, whole=True)
    assert max(map(len, frames)) <= MAX_BYTES
    assert of(frames)[0] == [float(k) for k in range(64)]
