"""A process that reads files for another one, which survives whatever the files do to it.

The process may take 1 GB of address space beyond what it has when a file begins: its imports, and
what earlier files have left. For each file it has 20 s of the processor, so that other work on the
machine makes no file slow. Linux sets both limits and macOS that of time. A file may take ten times
as long by the clock, since a reader could wait.
"""

from __future__ import annotations

import contextlib
import logging
import math
import multiprocessing
import signal
import sys
import tempfile
from collections.abc import Generator, Sequence
from multiprocessing.connection import Connection
from pathlib import Path
from types import TracebackType
from typing import Any

from cohaptic_server.objects.memory_limit import address_space
from fuzzing.cases import drafts
from fuzzing.judging import DIED, HUNG, MEMORY, Judge, Verdict, judge

MEMORY_LIMIT = 10**9  # bytes of address space beyond the imports
TIME_LIMIT = 20  # s of the processor for one file
_BY_THE_CLOCK = 10  # times as long a file may take while the process waits for the processor
_START_LIMIT = 300.0  # s until the process has imported everything, on a busy machine
_READY = "ready"


class Worker:
    """Reads files in a process of its own, which is started again when it has ended.

    Args:
        kinds: Kinds of the files, whose libraries are imported before memory is limited.
        seconds: Longest time of the processor for one file [s].
        judge: Reads a file; a function of a module, which the process imports.
    """

    def __init__(
        self, kinds: Sequence[str], seconds: int = TIME_LIMIT, judge: Judge = judge
    ) -> None:
        self._kinds, self._seconds, self._judge = tuple(kinds), seconds, judge
        self._context = multiprocessing.get_context("spawn")
        self._process: Any = None
        self._pipe: Any = None

    def __enter__(self) -> Worker:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._end()

    def judge(self, path: Path, simplify: int = 0) -> Verdict:
        """The verdict on a file, as of `judging.judge`; also `HUNG` or `DIED`."""
        process = self._process or self._start()
        try:
            self._pipe.send((path, simplify))
            if self._pipe.poll(_BY_THE_CLOCK * self._seconds):
                found: Verdict = self._pipe.recv()
                return found
            verdict = Verdict(HUNG, f"it takes more than {_BY_THE_CLOCK * self._seconds} s")
        except (EOFError, OSError):
            process.join(_BY_THE_CLOCK * self._seconds)
            words = f"the process ended with {process.exitcode}"
            verdict = Verdict(DIED, words, words)
            if sys.platform != "win32" and process.exitcode == -signal.SIGXCPU:
                verdict = Verdict(HUNG, f"it takes more than {self._seconds} s of the processor")
        self._end()
        return verdict

    def _start(self) -> Any:
        self._pipe, theirs = self._context.Pipe()
        self._process = self._context.Process(
            target=serve,
            args=(theirs, self._kinds, self._judge, self._seconds),
            name="reader",
            daemon=True,
        )
        self._process.start()
        theirs.close()
        if not self._pipe.poll(_START_LIMIT) or self._pipe.recv() != _READY:
            raise RuntimeError("the process that reads did not start")
        return self._process

    def _end(self) -> None:
        if self._process is not None:
            self._process.kill()
            self._process.join()
            self._process.close()
            self._pipe.close()
            self._process = None


def serve(pipe: Connection, kinds: Sequence[str], reading: Judge, seconds: int) -> None:
    """Read each file that is named, and send the verdict; runs in the new process."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C goes to the caller, who ends this process
    logging.disable()
    with tempfile.TemporaryDirectory() as folder:
        for kind in kinds:  # imports what reading needs
            file = Path(folder) / f"valid{kind}"
            file.write_bytes(drafts(kind)[0].packed())
            judge(file)
    pipe.send(_READY)
    with contextlib.suppress(EOFError):
        while True:
            path, simplify = pipe.recv()
            _limit_time(seconds)
            try:
                with _limited_memory():
                    found = reading(path, simplify)
            except MemoryError as error:
                found = Verdict(MEMORY, str(error), "MemoryError")
            pipe.send(found)


def _limit_time(seconds: int) -> None:
    """Let the system end this process after so many more seconds of the processor."""
    if sys.platform == "win32":
        return
    import resource

    used = resource.getrusage(resource.RUSAGE_SELF)
    limit = math.ceil(used.ru_utime + used.ru_stime) + seconds
    resource.setrlimit(resource.RLIMIT_CPU, (limit, resource.getrlimit(resource.RLIMIT_CPU)[1]))


@contextlib.contextmanager
def _limited_memory() -> Generator[None]:
    """Limit the address space of this process to its present size and `MEMORY_LIMIT`; on Linux."""
    if sys.platform != "linux":
        yield
        return
    import resource

    before = resource.getrlimit(resource.RLIMIT_AS)
    resource.setrlimit(resource.RLIMIT_AS, (address_space() + MEMORY_LIMIT, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_AS, before)
