"""A process that finds the columns a solid wants, beside the tick and behind everything in rank.

A process and not a thread: a thread of low rank that holds Python's lock while others of the
machine run would hold up the tick with it. Requests and answers are a few bytes in a pipe, so that
neither side can wait for the other; the columns themselves lie in memory that both see. One
request at a time, and the newest wish wins: after each answer it is asked anew what is wanted.
"""

from __future__ import annotations

import multiprocessing
import signal
from multiprocessing.connection import Connection
from typing import Any

import numpy as np
import numpy.typing as npt
from threadpoolctl import threadpool_limits

from cohaptic.runtime.scheduling import stand_back
from cohaptic_server.bodies.solid.column_store import Column
from cohaptic_server.bodies.solid.green_columns import ColumnRequest, solve_columns
from cohaptic_server.bodies.solid.solid import Solid
from cohaptic_server.cholesky.factor import Factor
from cohaptic_server.numeric import Ints

BATCH = 24  # vertices in one solve; a fingertip covers so many on a mesh that resolves it
_PATIENCE = 2.0  # s for the process to end by itself


class ColumnWorker:
    """Brings columns to one solid while it is served.

    Args:
        body: It answers from its far field from now on until columns come.
    """

    def __init__(self, body: Solid) -> None:
        body.in_background()
        self._body = body
        self._asked = False
        n = len(body.mesh.vertices)
        context = multiprocessing.get_context("spawn")
        self._rows = context.RawArray("q", n)
        self._values = context.RawArray("f", BATCH * n * 9)
        self._pipe, theirs = context.Pipe()
        # Half of the digits, for solves in half of the time.
        factor = body.columns.factor.single()
        self._process = context.Process(
            target=_work,
            args=(theirs, factor, body.columns.nodes, self._rows, self._values),
            name="columns",
            daemon=True,
        )
        self._theirs = theirs

    def start(self) -> None:
        """Begin."""
        self._process.start()
        self._theirs.close()

    def pump(self) -> None:
        """Hand over what was found, and ask for what is wanted now; before each tick, in no time.

        A process that has died is no error: the far field still answers.
        """
        try:
            if self._asked and self._pipe.poll():
                vertices, count = self._pipe.recv()
                self._asked = False
                self._body.deliver(self._found(vertices, count))
            elif not self._asked and not self._body.pending:
                request = self._body.request(BATCH)
                if request is not None:
                    self._pipe.send((request.vertices.tolist(), self._place(request.rows)))
                    self._asked = True
        except (OSError, EOFError):
            self._asked = True

    def stop(self) -> None:
        """End, after the batch at hand or without it."""
        self._pipe.close()
        self._process.join(_PATIENCE)
        if self._process.is_alive():
            self._process.kill()
            self._process.join()

    def _place(self, rows: Ints) -> int:
        _view(self._rows, np.int64)[: len(rows)] = rows
        return len(rows)

    def _found(self, vertices: list[int], count: int) -> list[Column]:
        rows = _view(self._rows, np.int64)[:count].copy()
        values = _view(self._values, np.float32)[: len(vertices) * count * 9]
        blocks = values.reshape(len(vertices), count, 9).copy()
        return [Column(v, rows, block) for v, block in zip(vertices, blocks, strict=True)]


def _view(shared: Any, kind: type[Any]) -> npt.NDArray[Any]:
    return np.frombuffer(shared, dtype=kind)


def _work(pipe: Connection, factor: Factor, nodes: Ints, rows: Any, values: Any) -> None:
    """The process: answer orders until the pipe closes."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the server ends it
    stand_back()
    with threadpool_limits(limits=1):
        while True:
            try:
                vertices, count = pipe.recv()
                request = ColumnRequest(np.array(vertices), _view(rows, np.int64)[:count].copy())
                found = solve_columns(factor, nodes, request)
                _view(values, np.float32)[: found.size] = found.ravel()
                pipe.send((vertices, count))
            except (OSError, EOFError):
                return
