"""A stream of values from the network's thread to a script, which loses none without saying so."""

from __future__ import annotations

import asyncio
import contextlib
import threading
from collections import deque
from collections.abc import AsyncIterator, Callable, Iterator
from functools import partial
from typing import Generic, TypeVar

Value = TypeVar("Value")
Block = TypeVar("Block")


class Stream(Generic[Block, Value]):
    """Values that a script takes one by one, with `for` or with `async for`; it waits for new ones.

    The stream ends when the hand has left and all values were taken. One script takes them, from
    one thread or one event loop.

    Args:
        limit: Number of values that may wait; the oldest are dropped beyond it.
        unpack: Function that makes the values of a block; it is called when they are taken.
        count: Function that returns the number of values of a block, without making them.

    Attributes:
        lost: Number of values that were dropped because the script was too slow.
    """

    def __init__(
        self,
        limit: int,
        unpack: Callable[[Block], list[Value]],
        count: Callable[[Block], int],
    ) -> None:
        self.lost = 0
        self._limit, self._unpack, self._count = limit, unpack, count
        self._blocks = deque[Block]()
        self._waiting = 0  # number of values in the blocks
        self._values = deque[Value]()  # of the block that is being taken
        self._ended = False
        self._changed = threading.Condition()
        self._wake: Callable[[], object] | None = None  # of a script that waits in an event loop

    def put(self, block: Block) -> None:
        """Add a block of values without waiting."""
        with self._changed:
            self._blocks.append(block)
            self._waiting += self._count(block)
            while self._waiting > self._limit and len(self._blocks) > 1:
                dropped = self._count(self._blocks.popleft())
                self._waiting -= dropped
                self.lost += dropped
            self._notify()

    def end(self) -> None:
        """Let the script's loop end once it has taken what waits."""
        with self._changed:
            self._ended = True
            self._notify()

    def _notify(self) -> None:
        self._changed.notify_all()
        wake, self._wake = self._wake, None
        if wake is not None:
            with contextlib.suppress(RuntimeError):  # the script's event loop has ended
                wake()

    def _take(self) -> bool:
        """Unpack the next block; return False if none waits. The condition has to be held."""
        if not self._blocks:
            return False
        block = self._blocks.popleft()
        self._waiting -= self._count(block)
        self._values.extend(self._unpack(block))
        return True

    def __iter__(self) -> Iterator[Value]:
        return self

    def __next__(self) -> Value:
        while not self._values:
            with self._changed:
                while not self._take():
                    if self._ended:
                        raise StopIteration
                    self._changed.wait()
        return self._values.popleft()

    def __aiter__(self) -> AsyncIterator[Value]:
        return self

    async def __anext__(self) -> Value:
        loop = asyncio.get_running_loop()
        while not self._values:
            # A script that has fallen behind must not hold up the network of its own event loop.
            await asyncio.sleep(0)
            came = asyncio.Event()
            with self._changed:
                if self._take():
                    continue
                if self._ended:
                    raise StopAsyncIteration
                self._wake = partial(loop.call_soon_threadsafe, came.set)
            await came.wait()
        return self._values.popleft()

    def new(self) -> list[Value]:
        """Return the values that wait, without waiting for more."""
        with self._changed:
            while self._take():
                pass
        found = list(self._values)
        self._values.clear()
        return found
