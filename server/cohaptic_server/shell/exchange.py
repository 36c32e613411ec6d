"""Replaces the body of a running server, and the process that solves for the body's columns."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from dataclasses import dataclass

from cohaptic_server.bodies.body import Body, elastic_of
from cohaptic_server.room.input_record import ColumnRecord
from cohaptic_server.shell.column_worker import ColumnWorker, HasColumns

Solve = Callable[[int], bytes]  # finds a vertex's block of Green's functions for pages
OBJECT_CHANGED = "there is another object now; connect again to touch it"


@dataclass(frozen=True, eq=False)
class Exchange:
    """A request to serve another body.

    Args:
        build: Makes the new body.
        use: Called with the new body when it can be served; returns the function that solves for
            its Green's functions for pages, or None if the body itself solves.
        done: Future that the code which asked for the exchange waits for.
    """

    build: Callable[[], Body]
    use: Callable[[Body], Solve | None]
    done: asyncio.Future[None]

    def succeed(self) -> None:
        """Report success to the code that waits on `done`, unless it has stopped waiting."""
        if not self.done.done():
            self.done.set_result(None)

    def fail(self, error: BaseException) -> None:
        """Report the error to the code that waits on `done`, unless it has stopped waiting."""
        if not self.done.done():
            self.done.set_exception(error)


class ServedBody:
    """Runs the process that solves for the columns of the served body, if the body needs one.

    Args:
        body: First body that is served.
    """

    def __init__(self, body: Body) -> None:
        self._worker = _worker_of(body)

    def start(self) -> None:
        """Start the process that solves for columns; the call takes longer than a tick."""
        if self._worker is not None:
            self._worker.start()

    @property
    def solve(self) -> Solve | None:
        """Function that solves for Green's functions for pages; None if the body itself solves."""
        return None if self._worker is None else self._worker.green_block

    def use(self, body: Body) -> Solve | None:
        """Replace the old body's process by one for a new body; return the new `solve`."""
        worker = _worker_of(body)
        if worker is not None:
            worker.start()
        self.stop()
        self._worker = worker
        return self.solve

    def pump(self, record: ColumnRecord | None = None) -> None:
        """Deliver solved columns and request missing ones; called before each tick.

        Args:
            record: As for `ColumnWorker.pump`.
        """
        if self._worker is not None:
            self._worker.pump(record)

    def stop(self) -> None:
        """End the process that solves for columns, if there is one."""
        if self._worker is not None:
            self._worker.stop()


def _worker_of(body: Body) -> ColumnWorker | None:
    elastic = elastic_of(body)
    return ColumnWorker(elastic) if isinstance(elastic, HasColumns) else None
