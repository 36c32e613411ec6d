"""Laws of the stream from the network to a script."""

from __future__ import annotations

import asyncio
import threading

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic_client.scripting.stream import Stream

BLOCKS = st.lists(st.lists(st.integers(), min_size=1, max_size=5), max_size=20)


def stream(limit: int) -> Stream[list[int], int]:
    return Stream(limit, list, len)


@given(blocks=BLOCKS, limit=st.integers(1, 60))
def test_what_is_not_taken_is_the_newest_or_counted_as_lost(
    blocks: list[list[int]], limit: int
) -> None:
    values = stream(limit)
    for block in blocks:
        values.put(block)
    values.end()
    everything = [value for block in blocks for value in block]
    taken = list(values)
    assert len(taken) <= max(limit, len(blocks[-1]) if blocks else 0)
    assert everything[len(everything) - len(taken) :] == taken
    assert values.lost == len(everything) - len(taken)


@given(blocks=BLOCKS, cut=st.integers(0, 10))
def test_each_value_comes_once_however_it_is_taken(blocks: list[list[int]], cut: int) -> None:
    values = stream(1000)
    everything = [value for block in blocks for value in block]
    for block in blocks:
        values.put(block)
    first = [next(values) for _ in range(min(cut, len(everything)))]
    rest = values.new()
    values.end()
    assert first + rest + list(values) == everything


def test_a_script_in_an_event_loop_takes_what_another_thread_puts() -> None:
    values = stream(1000)

    def put() -> None:
        for i in range(100):
            values.put([i])
        values.end()

    async def take() -> list[int]:
        thread = threading.Thread(target=put)
        thread.start()
        found = [value async for value in values]
        thread.join()
        return found

    assert asyncio.run(take()) == list(range(100))


def test_a_script_that_is_far_behind_lets_its_event_loop_work() -> None:
    values = stream(1000)
    for i in range(10):
        values.put([i])
    values.end()
    turns = list[int]()

    async def turn() -> None:
        while True:
            turns.append(1)
            await asyncio.sleep(0)

    async def take() -> None:
        other = asyncio.ensure_future(turn())
        async for _ in values:
            pass
        other.cancel()

    asyncio.run(take())
    assert len(turns) >= 10


def test_a_script_that_waits_in_a_thread_is_woken_by_a_value_and_by_the_end() -> None:
    values = stream(10)
    found = list[int]()
    thread = threading.Thread(target=lambda: found.extend(values))
    thread.start()
    values.put([1, 2])
    values.put([3])
    values.end()
    thread.join(60.0)
    assert found == [1, 2, 3]
    with pytest.raises(StopIteration):
        next(values)
