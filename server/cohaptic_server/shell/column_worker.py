"""A process of lowest priority that solves for the columns that a solid is missing.

It is a process and not a thread: a thread of low priority that is preempted while it holds Python's
global lock would hold up the tick. Requests and answers are a few bytes in a pipe, so that neither
side blocks; the columns themselves are in shared memory. There is one request at a time, and each
is made from the newest needs of the solid.
"""

from __future__ import annotations

import logging
import multiprocessing
import signal
from multiprocessing.connection import Connection
from typing import Any

import numpy as np
import numpy.typing as npt
from threadpoolctl import threadpool_limits

from cohaptic.runtime.scheduling import stand_back
from cohaptic_server.bodies.solid.column_store import Column
from cohaptic_server.bodies.solid.green_columns import ColumnRequest, columns_of, solve_columns
from cohaptic_server.bodies.solid.solid import Solid
from cohaptic_server.cholesky.shared_factor import SharedFactor
from cohaptic_server.numeric import Ints

BATCH = 24  # vertices in one solve; as many as a fingertip covers on a mesh that resolves it
_LOG = logging.getLogger(__name__)
_PATIENCE = 2.0  # s for the process to end by itself, before it is killed


class ColumnWorker:
    """Delivers columns to one solid while it is served.

    Args:
        body: Until a column is there, it answers from its far field.
    """

    def __init__(self, body: Solid) -> None:
        body.in_background()
        self._body = body
        self._asked: ColumnRequest | None = None
        self._dead = False
        rows = len(body.columns.places.order)
        context = multiprocessing.get_context("spawn")
        self._rows = context.RawArray("q", rows)
        self._values = context.RawArray("f", BATCH * rows * 9)
        self._pipe, theirs = context.Pipe()
        # Single precision halves the time of a solve. Both processes use the same numbers, and the
        # body's own are given up: it solves for nothing any more.
        factor = SharedFactor(body.columns.factor, context)
        body.columns.factor = factor.factor()
        self._process = context.Process(
            target=_work,
            args=(theirs, factor, body.columns.nodes, self._rows, self._values),
            name="columns",
            daemon=True,
        )
        self._theirs = theirs

    def start(self) -> None:
        """Start the process."""
        self._process.start()
        self._theirs.close()

    def pump(self) -> None:
        """Deliver solved columns and request missing ones; called before each tick, does not block.

        If the process has died, the solid goes on with its far field.
        """
        if self._dead:
            return
        try:
            if self._asked is not None and self._pipe.poll():
                self._body.deliver(self._found(self._asked, self._pipe.recv()))
                self._asked = None
            # Columns that the body has not taken yet still lie in the shared memory.
            elif self._asked is None and not self._body.pending:
                request = self._body.request(BATCH)
                if request is not None:
                    self._pipe.send((request.vertices.tolist(), self._place(request)))
                    self._asked = request
        except (OSError, EOFError):
            self._dead = True
            _LOG.warning(
                "the process that solves for places newly touched has ended; from now on they are"
                " felt through the far field, less exactly: start the server again when you can"
            )

    def stop(self) -> None:
        """End the process, after its present batch or in the middle of it."""
        self._dead = True
        self._pipe.close()
        self._process.join(_PATIENCE)
        if self._process.is_alive():
            self._process.kill()
            self._process.join()

    def _place(self, request: ColumnRequest) -> int:
        """Write the rows of a request where the process reads them; their number."""
        rows = self._body.columns.places.vertices(request.places)
        _view(self._rows, np.int64)[: len(rows)] = rows
        return len(rows)

    def _found(self, request: ColumnRequest, count: int) -> list[Column]:
        """The columns of a request with `count` values; nothing is copied."""
        return columns_of(request, _view(self._values, np.float32)[:count])


def _view(shared: Any, kind: type[Any]) -> npt.NDArray[Any]:
    return np.frombuffer(shared, dtype=kind)


def _work(pipe: Connection, shared: SharedFactor, nodes: Ints, rows: Any, values: Any) -> None:
    """Main function of the process: answer requests until the pipe closes."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the server ends it
    stand_back()
    factor = shared.factor()
    with threadpool_limits(limits=1):
        while True:
            try:
                vertices, count = pipe.recv()
                observed = _view(rows, np.int64)[:count]
                found = solve_columns(factor, nodes, np.array(vertices), observed)
                _view(values, np.float32)[: found.size] = found.ravel()
                pipe.send(found.size)
            except (OSError, EOFError):
                return
