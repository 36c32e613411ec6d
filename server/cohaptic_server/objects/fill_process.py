"""Runs fTetWild in a process of its own, which can be watched, stopped and limited in memory.

In the caller's process fTetWild would hold Python's lock until it ends: the progress bar would
stand still, Ctrl-C would have no effect, and a crash would end the caller. If fTetWild runs in a
process of its own, the caller reads its output and can end it at once, and on Linux the system
limits its memory. If the caller is killed, fTetWild ends at the next line that it prints (on
Windows it runs to its end); its temporary folder then stays behind.

Progress is read from the output: the phases, and the passes of the optimisation. The number of
passes is unknown in advance, since fTetWild stops when its worst element is good enough: 4 on a
torus of 3,000 triangles, 10 on a noisy scan of 60,000. Each pass is therefore counted as the same
share of the remaining progress, and the total share never decreases.
"""

from __future__ import annotations

import contextlib
import json
import math
import os
import signal
import subprocess
import sys
import tempfile
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import IO, Any, cast

import numpy as np

from cohaptic.clock import SystemClock
from cohaptic.errors import BodyError
from cohaptic_server.numeric import Floats, Ints

# Text of a line that ends each phase, and the share of the run's time that has passed then, as
# measured on a scan of 60,000 triangles; a clean surface of 3,000 differs by 0.1.
_PHASES = (
    ("collapsing ", 0.09),  # the surface was simplified within the envelope
    ("triangle insertion start", 0.1),
    ("mark_surface_fs done", 0.15),
    ("initializing...", 0.16),
    ("edge collapsing done!", 0.2),
)
_OPTIMISED = 0.2  # share at which the passes begin
_POST = 0.93  # share at which the passes end
_PASS = 0.18  # share of the remaining passes' time that each pass takes
# Shares of a pass at the end of the first three of its four steps.
_STEPS = {"edge splitting": 0.02, "edge collapsing": 0.5, "edge swapping": 0.65}
_COMPLETED = 0.98


class FillLog:
    """Reads the progress of one run of fTetWild from the lines that it prints.

    Attributes:
        fraction: Approximate share of the run's time, from 0 to 1; it never decreases.
        passes: Number of optimisation passes that have begun.
    """

    def __init__(self) -> None:
        self.fraction, self.passes = 0.0, 0
        self._post = False

    def read(self, line: str) -> float:
        """Read a line, and return the share of the run's time that has passed after it."""
        self.fraction = max(self.fraction, self._fraction(line))
        return self.fraction

    def _fraction(self, line: str) -> float:
        if "//// pass " in line:
            self.passes += 1
            return self._at_pass(0.0)
        if "postprocessing" in line:
            self._post = True
            return _POST
        if "Tetrahedralization completed" in line:
            return _COMPLETED
        if self._post:
            return 0.0
        if self.passes:
            step = line.removesuffix(" done!") if line.endswith(" done!") else ""
            return self._at_pass(_STEPS[step]) if step in _STEPS else 0.0
        return max((fraction for mark, fraction in _PHASES if mark in line), default=0.0)

    def _at_pass(self, done: float) -> float:
        left: float = (1.0 - _PASS) ** (self.passes - 1 + done)
        return _OPTIMISED + (_POST - _OPTIMISED) * (1.0 - left)


_EVERY = 0.1  # s between two looks at the process
_OUT_OF_MEMORY = 3  # exit status of the process
_INPUT, _OUTPUT = "surface.npz", "tetrahedra.npz"
_VERBOSE = 2  # level at which fTetWild's log contains its phases


class FillLimitError(BodyError):
    """Filling was stopped at a limit of memory or time."""


def fill(
    x: Floats,
    faces: Ints,
    options: dict[str, float],
    *,
    memory: float = math.inf,
    seconds: float = math.inf,
    progress: Callable[[float], None] = lambda fraction: None,
) -> tuple[Floats, Ints]:
    """Fill a surface by fTetWild; return vertices, shape (k, 3) [m], and tetrahedra, (t, 4).

    Args:
        x: Vertices of the surface, shape (n, 3) [m].
        faces: Triangles of the surface, shape (m, 3).
        options: Options of `pytetwild.tetrahedralize`.
        memory: Limit of fTetWild's memory [bytes]; enforced by the system, on Linux only.
        seconds: Limit of the time [s].
        progress: Called with the share that is done, about ten times a second.

    Raises:
        FillLimitError: Filling would take more memory or time.
        BodyError: fTetWild failed.
    """
    with tempfile.TemporaryDirectory(prefix="cohaptic-fill-") as scratch:
        folder = Path(scratch)
        np.savez(folder / _INPUT, x=x, faces=faces)
        command = [sys.executable, "-m", __name__, scratch, str(memory), json.dumps(options)]
        path = os.pathsep.join(entry for entry in sys.path if entry)
        with subprocess.Popen(
            command,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            cwd=folder,  # fTetWild leaves files in its working directory
            env=os.environ | {"PYTHONPATH": path, "OMP_NUM_THREADS": "1"},
            text=True,
            errors="replace",
        ) as process:
            words = _watch(process, seconds, progress)
        if process.returncode == _OUT_OF_MEMORY or "bad_alloc" in words:
            raise FillLimitError(f"filling it needs more than {memory / 1e9:.3g} GB")
        if process.returncode or not (folder / _OUTPUT).is_file():
            how = f"signal {-process.returncode}" if process.returncode < 0 else words or "no word"
            raise BodyError(f"fTetWild could not fill the surface (it ended with {how})")
        with np.load(folder / _OUTPUT) as found:
            return np.array(found["x"], np.float64), np.array(found["tets"], np.int64)


def _watch(
    process: subprocess.Popen[str], seconds: float, progress: Callable[[float], None]
) -> str:
    """Report progress until a process ends or its time is over; return its last line of errors.

    Raises:
        FillLimitError: The process runs longer than `seconds` [s].
    """
    log, last = FillLog(), [""]

    def lines(stream: IO[str] | None) -> Iterator[str]:
        # Ctrl-C while a thread is being started closes the stream before the thread reads it.
        with contextlib.suppress(ValueError):
            yield from cast(IO[str], stream)

    def read() -> None:
        for line in lines(process.stdout):
            log.read(line.strip())

    def read_errors() -> None:
        for line in lines(process.stderr):
            last[0] = line.strip() or last[0]

    readers = [threading.Thread(target=work, daemon=True) for work in (read, read_errors)]
    clock = SystemClock()
    begin = clock.now()
    try:
        for reader in readers:
            reader.start()
        while _runs(process):
            progress(log.fraction)
            if clock.now() - begin > seconds:
                raise FillLimitError(f"filling it takes more than {seconds:g} s")
    finally:
        process.kill()
        for reader in readers:
            if reader.is_alive():  # an interruption may come before the thread was started
                reader.join()
    progress(1.0)
    return last[0]


def _runs(process: subprocess.Popen[str]) -> bool:
    """Wait up to `_EVERY` [s] for a process to end; return whether it still runs."""
    with contextlib.suppress(subprocess.TimeoutExpired):
        process.wait(_EVERY)
        return False
    return True


def main(folder: Path, memory: float, options: dict[str, float]) -> None:
    """Read a surface, fill it and write the tetrahedra; this function runs in the new process."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C goes to the caller, who ends this process
    if sys.platform != "win32":
        signal.signal(signal.SIGPIPE, signal.SIG_DFL)  # ends the process once its reader is gone
    from pytetwild.pytetwild import tetrahedralize

    with np.load(folder / _INPUT) as given:
        x, faces = given["x"], np.asarray(given["faces"], dtype=np.int32)
    if sys.platform == "linux" and math.isfinite(memory):
        import resource

        resource.setrlimit(resource.RLIMIT_DATA, (int(memory), int(memory)))
    chosen: dict[str, Any] = {**options, "num_threads": 1, "quiet": False, "loglevel": _VERBOSE}
    try:
        found_x, tets = tetrahedralize(x, faces, **chosen)
    except (MemoryError, RuntimeError) as error:
        # At the memory limit starting a thread fails as well, with another message.
        if isinstance(error, RuntimeError) and "temporarily unavailable" not in str(error):
            raise
        os._exit(_OUT_OF_MEMORY)
    part = folder / f"part-{_OUTPUT}"
    np.savez(part, x=found_x, tets=tets)
    os.replace(part, folder / _OUTPUT)


if __name__ == "__main__":
    main(Path(sys.argv[1]), float(sys.argv[2]), json.loads(sys.argv[3]))
