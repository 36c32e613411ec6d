"""The exchange of a server's object for another one, and the process that goes with each."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from dataclasses import dataclass

from cohaptic_server.bodies.body import Body, elastic_of
from cohaptic_server.shell.column_worker import ColumnWorker, HasColumns

Solve = Callable[[int], bytes]  # finds a vertex's block of Green's functions for pages
OBJECT_CHANGED = "there is another object now; connect again to touch it"


@dataclass(frozen=True, eq=False)
class Exchange:
    """A wish for another object.

    Args:
        build: Makes the body.
        use: Called with it once it can be served; returns what solves its Green's functions for
            pages, None for the body itself.
        done: For who waits.
    """

    build: Callable[[], Body]
    use: Callable[[Body], Solve | None]
    done: asyncio.Future[None]

    def succeed(self) -> None:
        """Tell who waits, if it still does."""
        if not self.done.done():
            self.done.set_result(None)

    def fail(self, error: BaseException) -> None:
        """Tell who waits, if it still does."""
        if not self.done.done():
            self.done.set_exception(error)


class ServedBody:
    """The body that is served, and the process that solves for its columns, if it is a solid.

    Args:
        body: The first.
    """

    def __init__(self, body: Body) -> None:
        self._worker = _worker_of(body)

    def start(self) -> None:
        """Start the process; it takes longer than a tick has."""
        if self._worker is not None:
            self._worker.start()

    @property
    def solve(self) -> Solve | None:
        """What solves Green's functions for pages; None for the body itself."""
        return None if self._worker is None else self._worker.green_block

    def use(self, body: Body) -> Solve | None:
        """Take another body in place of the one of before, with a process of its own."""
        worker = _worker_of(body)
        if worker is not None:
            worker.start()
        self.stop()
        self._worker = worker
        return self.solve

    def pump(self) -> None:
        """Before each tick: deliver columns and ask for missing ones."""
        if self._worker is not None:
            self._worker.pump()

    def stop(self) -> None:
        """End the process."""
        if self._worker is not None:
            self._worker.stop()


def _worker_of(body: Body) -> ColumnWorker | None:
    elastic = elastic_of(body)
    return ColumnWorker(elastic) if isinstance(elastic, HasColumns) else None
