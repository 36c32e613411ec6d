"""Exchanges the object of a server for another one, together with its solving process."""

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
    """A request for another object.

    Args:
        build: Makes the body.
        use: Called with the body once it can be served; returns the function that solves its
            Green's functions for pages, None if the body itself solves.
        done: Future that the requester waits for.
    """

    build: Callable[[], Body]
    use: Callable[[Body], Solve | None]
    done: asyncio.Future[None]

    def succeed(self) -> None:
        """Report success to the requester, unless it waits no longer."""
        if not self.done.done():
            self.done.set_result(None)

    def fail(self, error: BaseException) -> None:
        """Report the error to the requester, unless it waits no longer."""
        if not self.done.done():
            self.done.set_exception(error)


class ServedBody:
    """The process that solves for the columns of the served body, if that is a solid.

    Args:
        body: First body that is served.
    """

    def __init__(self, body: Body) -> None:
        self._worker = _worker_of(body)

    def start(self) -> None:
        """Start the process; the call takes longer than a tick."""
        if self._worker is not None:
            self._worker.start()

    @property
    def solve(self) -> Solve | None:
        """Function that solves Green's functions for pages; None if the body itself solves."""
        return None if self._worker is None else self._worker.green_block

    def use(self, body: Body) -> Solve | None:
        """Replace the body by another one, with a new process; returns its `solve`."""
        worker = _worker_of(body)
        if worker is not None:
            worker.start()
        self.stop()
        self._worker = worker
        return self.solve

    def pump(self) -> None:
        """Deliver solved columns and request missing ones; called before each tick."""
        if self._worker is not None:
            self._worker.pump()

    def stop(self) -> None:
        """End the process."""
        if self._worker is not None:
            self._worker.stop()


def _worker_of(body: Body) -> ColumnWorker | None:
    elastic = elastic_of(body)
    return ColumnWorker(elastic) if isinstance(elastic, HasColumns) else None
