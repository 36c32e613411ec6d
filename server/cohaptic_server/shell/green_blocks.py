"""Green's functions, solved one at a time beside the tick and cached.

A solve on a large solid takes longer than a tick. A thread of its own solves, or waits for the
process that does (`column_worker.py`); the request waits for it and the tick does not.
"""

from __future__ import annotations

import asyncio
from collections import OrderedDict
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

from cohaptic_server.shell.column_worker import Unsolved

_KEPT_BYTES = 64 * 2**20
_MAX_WAITING = 64  # solves that are queued; more than the vertices under one hand


class GreenBlocks:
    """Cache of encoded blocks by vertex; the least recently used are dropped first.

    Args:
        solve: Finds the block of a vertex, in another thread than the tick's; raises `Unsolved`
            where nobody can any more.
        kept_bytes: Size of the cache.

    Attributes:
        solved: Number of blocks solved so far.
    """

    def __init__(self, solve: Callable[[int], bytes], kept_bytes: int = _KEPT_BYTES) -> None:
        self._solve = solve
        self._kept_bytes = kept_bytes
        self._kept: OrderedDict[int, bytes] = OrderedDict()
        self._solving: dict[int, asyncio.Future[bytes]] = {}
        self._thread = ThreadPoolExecutor(1, "green")
        self._closed = False
        self.solved = 0

    @property
    def waiting(self) -> int:
        """Number of blocks that are being solved or queued."""
        return len(self._solving)

    async def block(self, vertex: int, patience: float) -> bytes | None:
        """Block of a vertex; None if it was not solved within `patience` [s], or cannot be."""
        if vertex in self._kept:
            self._kept.move_to_end(vertex)
            return self._kept[vertex]
        if vertex not in self._solving:
            if self._closed or len(self._solving) >= _MAX_WAITING:
                return None
            loop = asyncio.get_running_loop()
            task = loop.run_in_executor(self._thread, self._solve, vertex)
            task.add_done_callback(lambda done: self._keep(vertex, done))
            self._solving[vertex] = task
        # The solve goes on after a timeout, for the next request.
        solving = self._solving[vertex]
        try:
            return await asyncio.wait_for(asyncio.shield(solving), patience)
        except (TimeoutError, Unsolved):
            return None
        except asyncio.CancelledError:
            # By `close`, and not who asked: that one still has to be answered.
            asking = asyncio.current_task()
            if solving.cancelled() and (asking is None or not asking.cancelling()):
                return None
            raise

    def close(self) -> None:
        """Cancel queued solves and accept no more; who waits for one gets None."""
        self._closed = True
        self._thread.shutdown(wait=False, cancel_futures=True)

    def _keep(self, vertex: int, done: asyncio.Future[bytes]) -> None:
        del self._solving[vertex]
        if done.cancelled() or done.exception() is not None:
            return
        self.solved += 1
        self._kept[vertex] = done.result()
        while len(self._kept) > 1 and sum(map(len, self._kept.values())) > self._kept_bytes:
            self._kept.popitem(last=False)
