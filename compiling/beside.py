"""`python -m compiling.beside --lifeline`: compile at the lowest priority, beside something else.

What starts it, such as the demo, holds its standard input. When that closes, however the other
process has ended, everything ends here at once: what compiles is killed, with all that it has
started, and their temporary files are deleted. What was finished by then is kept.

The first line of its output says what it does; there is none where there is nothing to do.
"""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
import tempfile
import threading
from pathlib import Path

from compiling import tools
from compiling.build import stale
from compiling.compiler import missing

NICENESS = 19  # the lowest there is: an idle processor's time, and little of a busy one's


def main() -> None:
    """Entry point."""
    give_way()
    root = Path(__file__).parents[1]
    # Only what `make demo` starts may fetch: it has just installed by the same network.
    if not tools.are_here() and os.environ.get("COHAPTIC_COMPILE") != "fetch":
        return
    if missing() or not stale(root):
        return
    fetched = "" if tools.are_here() else ", with Cython and mypy that pip fetches for it"
    print(
        f"compiling beside the demo, for faster ticks from the next start on{fetched}", flush=True
    )
    with tempfile.TemporaryDirectory(prefix="cohaptic-compiling-") as temporary:
        job = subprocess.Popen(
            [sys.executable, "-m", "compiling", "--beside"],
            cwd=root,
            env={**os.environ, "TMPDIR": temporary},
            stdin=subprocess.DEVNULL,
            stdout=sys.stderr,  # the log of what has started this
            process_group=0,  # what it starts, a compiler's processes too, is killed with it
        )
        threading.Thread(target=_end_with_input, args=(job.pid,), daemon=True).start()
        job.wait()


def give_way() -> None:
    """Get the processor when nobody else wants it."""
    os.nice(NICENESS)
    # Where the kernel shares the processor among sessions first, niceness holds within one only.
    # The session of somebody else, such as a terminal or a suite of tests, stays as it is.
    if os.getsid(0) == os.getpid():
        with contextlib.suppress(OSError):
            Path("/proc/self/autogroup").write_text(str(NICENESS))


def _end_with_input(group: int) -> None:
    while os.read(sys.stdin.fileno(), 4096):
        pass
    with contextlib.suppress(ProcessLookupError):
        os.killpg(group, signal.SIGKILL)


if __name__ == "__main__":
    main()
