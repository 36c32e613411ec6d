"""Main function and shared memory of the process that solves for compliance columns.

`column_worker.py` starts the process.
"""

from __future__ import annotations

import signal
from dataclasses import dataclass
from multiprocessing.connection import Connection
from multiprocessing.context import SpawnContext
from typing import Any, NamedTuple

import numpy as np
from threadpoolctl import threadpool_limits

from cohaptic.errors import BodyError
from cohaptic.runtime.scheduling import stand_back
from cohaptic_server.bodies.green import encode_block
from cohaptic_server.bodies.solid.green_columns import solve_columns
from cohaptic_server.cholesky.factor import Factor, FactorReader
from cohaptic_server.cholesky.factor_file import as_ints, shared_ints
from cohaptic_server.numeric import Ints, Narrow


class Task(NamedTuple):
    """A request to the process: solve for the displacements under unit forces on some vertices.

    Args:
        vertices: Vertices on which the unit forces act.
        rows: Number of vertices in `Inbox.rows` whose displacement is wanted; 0 asks for the block
            of Green's functions of one vertex, for pages.
    """

    vertices: list[int]
    rows: int


@dataclass(frozen=True, eq=False)
class Inbox:
    """Memory that the server and the solving process share, since their pipe carries few bytes.

    Args:
        nodes: Index of each surface vertex among the free nodes of the mesh, as from `shared_ints`.
        rows: Vertices whose displacement is wanted.
        values: Displacements that the process has solved for [m/N], or the bytes of a block.
    """

    nodes: tuple[Any, tuple[int, ...]]
    rows: Any
    values: Any

    @classmethod
    def of(cls, nodes: Ints, rows: int, context: SpawnContext) -> Inbox:
        """Make shared memory for a batch of columns with `rows` rows altogether."""
        return cls(
            shared_ints(nodes, context),
            context.RawArray("q", rows),
            context.RawArray("f", 9 * rows),
        )

    def put_rows(self, rows: Ints) -> None:
        """Write the vertices whose displacement a task asks for."""
        np.frombuffer(self.rows, dtype=np.int64)[: len(rows)] = rows

    def rows_of(self, task: Task) -> Ints:
        """Read the vertices whose displacement a task asks for."""
        return np.frombuffer(self.rows, dtype=np.int64)[: task.rows]


def as_values(shared: Any) -> Narrow:
    """Return a view of shared memory as numbers of single precision."""
    return np.frombuffer(shared, dtype=np.float32)


def as_bytes(shared: Any) -> Any:
    """Return a view of shared memory as bytes."""
    return np.frombuffer(shared, dtype=np.uint8)


def solve_until_closed(pipe: Connection, reader: FactorReader, inbox: Inbox) -> None:
    """Solve the server's tasks until the pipe closes; the main function of the process.

    The first answer is an empty text, which says that the process has read an intact factorisation.
    Any other text is the reason why the process ends.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the server ends this process
    stand_back()
    try:
        with threadpool_limits(limits=1):
            try:
                factor = reader.read()
            except (BodyError, OSError) as error:
                pipe.send(str(error))
                return
            pipe.send("")
            nodes = as_ints(inbox.nodes)
            while True:
                task: Task = pipe.recv()
                # The factor's file is checked before the solve, since reading behind the end of a
                # shortened file ends the process, and afterwards, since it may change meanwhile.
                count = 0 if reader.problem() else _solve(factor, nodes, task, inbox)
                problem = reader.problem()
                pipe.send(problem or count)
                if problem:
                    return
    except (OSError, EOFError):
        return


def _solve(factor: Factor, nodes: Ints, task: Task, inbox: Inbox) -> int:
    """Solve a task; return the number of values, or of bytes of a block, in shared memory."""
    vertices = np.array(task.vertices)
    if task.rows:
        found = solve_columns(factor, nodes, vertices, inbox.rows_of(task))
        as_values(inbox.values)[: found.size] = found.ravel()
        return int(found.size)
    whole = solve_columns(factor, nodes, vertices, np.arange(len(nodes)))
    green = whole.reshape(-1, 3, 3).transpose(1, 0, 2).astype(np.float64)
    block = np.frombuffer(encode_block(green), dtype=np.uint8)
    as_bytes(inbox.values)[: len(block)] = block
    return len(block)
