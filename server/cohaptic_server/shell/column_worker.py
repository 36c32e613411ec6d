"""Solves for missing compliance columns and for pages' Green's functions outside the tick.

A separate process of lowest priority solves. A thread of low priority would delay the tick if the
system preempted it while it holds Python's global lock. Requests and answers are a few bytes in a
pipe, so that neither process blocks; the solutions are in shared memory. At most one request is
open at a time, for the columns that the solid needs most then. While a column is missing, the solid
uses its far field instead. If the process ends (the system kills the largest process when memory is
short), the worker starts it again up to `_TRIES` times, with exponential back-off.
"""

from __future__ import annotations

import logging
import math
import multiprocessing
import sys
import threading
from collections import deque
from collections.abc import Iterable
from concurrent.futures import Future
from multiprocessing import resource_tracker
from typing import Protocol, runtime_checkable

from cohaptic.clock import SystemClock
from cohaptic.errors import CohapticError
from cohaptic.runtime.interrupt import uninterrupted
from cohaptic.runtime.scheduling import stand_back
from cohaptic.sessions.entries import Asked, Solved
from cohaptic_server.bodies.solid.column_store import Column
from cohaptic_server.bodies.solid.green_columns import ColumnRequest, GreenColumns, columns_of
from cohaptic_server.cholesky.factor import Factor
from cohaptic_server.cholesky.factor_file import SharedFactor
from cohaptic_server.room.input_record import ColumnRecord
from cohaptic_server.shell.column_process import (
    Inbox,
    Task,
    as_bytes,
    as_values,
    solve_until_closed,
)

BATCH = 24  # vertices in one solve: the number under a fingertip on a mesh that resolves it
_LOG = logging.getLogger(__name__)
_PAUSE = 1.0  # s until a process that has ended is started again; doubled after each try
_TRIES = 5
_LASTING = 60.0  # s; a process that was ready for longer resets the number of tries
_TURN = 4  # solves, of which one is for a page even if users still need columns


class Unsolved(CohapticError):
    """Error: the process that solves for the columns has ended and is not started again."""


@runtime_checkable
class HasColumns(Protocol):
    """A body that uses compliance columns, for which another process can solve."""

    @property
    def columns(self) -> GreenColumns:
        """Store of the columns that are known so far, with the factorisation that yields more."""
        ...

    @property
    def at_once(self) -> bool:
        """Whether a response waits for its columns, which this process then solves for."""
        ...

    @property
    def pending(self) -> int:
        """Number of delivered columns that are not in use yet."""
        ...

    def in_background(self, *, fill: bool = True) -> None:
        """Stop solving for columns in this process; `request` then lists the missing columns."""
        ...

    def request(self, limit: int) -> ColumnRequest | None:
        """Return a request for the `limit` most needed columns; None if no column is missing."""
        ...

    def deliver(self, columns: Iterable[Column]) -> None:
        """Add columns that the process has solved for."""
        ...


class ColumnWorker:
    """Runs the process that solves for the compliance columns of one solid, and delivers them.

    Args:
        body: Solid whose columns are solved for; while a column is missing, it uses its far field.

    Raises:
        OSError: There is not enough shared memory.
    """

    def __init__(self, body: HasColumns) -> None:
        body.in_background(fill=False)
        self._body = body
        self._asked: ColumnRequest | Future[bytes] | None = None
        self._blocks: deque[tuple[int, Future[bytes]]] = deque()  # one per waiting thread
        self._since_block = 0
        self._record: ColumnRecord | None = None
        self._block = 0  # vertex of the last requested block
        self._ready = self._dead = False
        self._clock = SystemClock()
        self._tries, self._again = 0, math.inf  # time of the next start of the process [s]
        self._ready_since = math.inf
        self._starting: threading.Thread | None = None
        self._context = context = multiprocessing.get_context("spawn")
        columns = body.columns
        # A factorisation that exists only in the memory of this process moves to shared memory;
        # this process no longer solves with it.
        if isinstance(columns.given, Factor):
            columns.given = SharedFactor(columns.given, context)
        self._inbox = Inbox.of(columns.nodes, BATCH * len(columns.places.order), context)
        self._make()
        # A thread fills the memory for columns during the start; no column is requested before.
        self._filling = threading.Thread(target=columns.store.fill, daemon=True)

    def start(self) -> None:
        """Start the process, which reads the factorisation while the server already runs."""
        self._filling.start()
        self._launch()

    def _make(self) -> None:
        """Make the pipe and the process object, without starting the process."""
        self._pipe, self._theirs = self._context.Pipe()
        self._process = self._context.Process(
            target=solve_until_closed,
            args=(self._theirs, self._body.columns.given, self._inbox),
            name="columns",
            daemon=True,
        )

    def _launch(self) -> None:
        if sys.platform != "win32":
            # Started here, since a start within the block below would unblock the signals again.
            resource_tracker.ensure_running()
        with uninterrupted():  # Ctrl-C is for the server, which ends this process
            self._process.start()
        assert self._process.pid is not None
        stand_back(self._process.pid)
        self._theirs.close()

    def pump(self, record: ColumnRecord | None = None) -> None:
        """Deliver solved columns and request more, without blocking; called before each tick.

        Args:
            record: Takes down when columns are asked for, and when they come; None where nothing
                records the session.
        """
        self._record = record
        if self._dead:
            return
        if self._again < math.inf or self._starting is not None:
            self._start_again()
            return
        try:
            if self._pipe.poll():
                self._take(self._pipe.recv())
            # Columns that the body has not taken yet still lie in the shared memory.
            if self._ready and self._asked is None and not self._body.pending:
                self._ask()
        except (OSError, EOFError):
            code = None
            if self._process.pid is not None:
                self._process.join(0.0)
                code = self._process.exitcode
            self._lose("ended" + (f" by signal {-code}" if code is not None and code < 0 else ""))

    def green_block(self, vertex: int) -> bytes:
        """Return the Green's functions of a vertex, encoded for pages (`encode_block`).

        The call waits for the process, so the thread that runs the ticks must not make it.

        Raises:
            Unsolved: The process has ended and is not started again.
        """
        found: Future[bytes] = Future()
        self._blocks.append((vertex, found))
        if self._dead:
            self._give_up()
        return found.result()

    def _start_again(self) -> None:
        """After the back-off, start the process in a thread: a start takes longer than a tick."""
        if self._starting is not None:
            if not self._starting.is_alive():
                self._starting = None
        elif self._clock.now() >= self._again:
            self._again = math.inf
            self._pipe.close()
            self._make()
            self._starting = threading.Thread(target=self._launch_or_lose, daemon=True)
            self._starting.start()

    def _launch_or_lose(self) -> None:
        try:
            self._launch()
        except OSError:  # no memory for the process: `pump` finds the pipe closed and tries again
            self._theirs.close()

    def stop(self) -> None:
        """Kill the process at once, since it has nothing to clean up."""
        self._dead = True
        self._give_up()
        if self._starting is not None:
            self._starting.join()
        self._pipe.close()
        if self._process.pid is not None:
            self._process.kill()
            self._process.join()

    def _take(self, answer: int | str) -> None:
        """Handle an answer of the process: a count of values or bytes, or why the process ends."""
        asked, self._asked = self._asked, None
        if isinstance(answer, str):
            if answer:
                self._lose(f"cannot go on: {answer}", for_good=True)
                return
            if self._tries:
                _LOG.info("the process that solves for places newly touched is back")
            self._ready, self._ready_since = True, self._clock.now()
        elif isinstance(asked, Future):
            asked.set_result(as_bytes(self._inbox.values)[:answer].tobytes())
        elif asked is not None:
            self._body.deliver(self._found(asked, answer))
            if self._record is not None:
                self._record(Solved)

    def _ask(self) -> None:
        if self._filling.is_alive():
            return
        request = self._body.request(BATCH)
        if self._blocks and (request is None or self._since_block >= _TURN - 1):
            self._block, found = self._blocks.popleft()
            self._asked, self._since_block = found, 0
            self._pipe.send(Task([self._block], 0))
        elif request is not None:
            rows = self._body.columns.places.vertices(request.places)
            self._inbox.put_rows(rows)
            self._asked, self._since_block = request, self._since_block + 1
            self._pipe.send(Task(request.vertices.tolist(), len(rows)))
            if self._record is not None:
                self._record(Asked)

    def _found(self, request: ColumnRequest, count: int) -> list[Column]:
        """Return the solved columns of a request, as views of `count` values in shared memory."""
        return columns_of(request, as_values(self._inbox.values)[:count])

    def _lose(self, what: str, *, for_good: bool = False) -> None:
        """Handle the end of the process: plan its next start with back-off, or stop starting it."""
        now = self._clock.now()
        if now - self._ready_since > _LASTING:
            self._tries = 0
        self._ready, self._ready_since = False, math.inf
        if not for_good and self._tries < _TRIES:
            pause = _PAUSE * 2.0**self._tries
            self._tries += 1
            self._again = now + pause
            # The solid requests missing columns again by itself, but a page waits for its block.
            if isinstance(self._asked, Future):
                self._blocks.appendleft((self._block, self._asked))
            self._asked = None
            _LOG.warning(
                "the process that solves for places newly touched %s; it is started again in %g s"
                " (%d of %d), until then they are felt through the far field, less exactly",
                what, pause, self._tries, _TRIES,
            )  # fmt: skip
            return
        self._dead = True
        self._give_up()
        _LOG.warning(
            "the process that solves for places newly touched %s; from now on they are felt through"
            " the far field, less exactly: start the server again when you can",
            what,
        )

    def _give_up(self) -> None:
        """Raise `Unsolved` in all threads that wait for Green's functions."""
        if isinstance(self._asked, Future):
            self._blocks.append((0, self._asked))
            self._asked = None
        while self._blocks:
            try:
                _, found = self._blocks.popleft()
            except IndexError:  # another thread has just taken the last one
                return
            if not found.done():
                found.set_exception(Unsolved("the process that solves for columns has ended"))
