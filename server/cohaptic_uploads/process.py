"""Starts a worker process, exchanges messages with it, and ends it.

Every call except `kill` may block, so a separate thread makes these calls, one at a time.
"""

from __future__ import annotations

import contextlib
import json
import os
import subprocess
import sys
from dataclasses import asdict, dataclass
from typing import IO, Any

from cohaptic.errors import CohapticError
from cohaptic.runtime.scheduling import stand_back
from cohaptic_server.objects.store import shared
from cohaptic_uploads.confine import TOO_MUCH_MEMORY
from cohaptic_uploads.kept_files import MARK, give_up
from cohaptic_uploads.limits import UploadLimits
from cohaptic_uploads.pipe import DATA, PipeEnded, receive, send, send_text
from cohaptic_uploads.work_folder import WorkFolder, bytes_in_work, remove_abandoned

_PATIENCE = 5.0  # s to wait for the end of a process that was killed
_SIGXCPU, _SIGXFSZ, _SIGABRT, _SIGSEGV, _SIGKILL = 24, 25, 6, 11, 9  # as Linux numbers them
# With more threads the thread pools of libraries would reserve memory for each core.
_ONE_THREAD = dict.fromkeys(
    ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS"), "1"
)


def _own_environment() -> dict[str, str]:
    """Return the environment of a process that reads a stranger's file: it knows no storage."""
    others = ("AWS_", "FSSPEC_", shared.VARIABLE)
    return {name: word for name, word in os.environ.items() if not name.startswith(others)}


@dataclass(frozen=True, slots=True)
class Rubber:
    """Parameters with which `build_affordable` makes a nonlinear solid.

    Args:
        period: Simulation period, within which a tick must solve the solid for two users [s].
        damping: B_o over K_o of eq. (9): relaxation time over simulation period.
    """

    period: float
    damping: float


class UploadFailed(CohapticError):
    """Error: an upload failed; the text says why."""


class WorkerProcess:
    """Handle of a worker process, which the constructor starts.

    Args:
        name: Name of the visitor's file.
        rubber: Parameters for making a nonlinear solid from the file; None makes a linear solid.

    Raises:
        UploadFailed: All uploads together take too much disk space, or the disk is full.
        OSError: The process cannot be started.
    """

    def __init__(self, limits: UploadLimits, name: str, rubber: Rubber | None = None) -> None:
        self._limits = limits
        self._folder = _new_folder(limits)
        reported = {
            "folder": str(self._folder.path),
            "memory": limits.memory,
            "cpu": limits.examine + limits.prepare,
            "preview": limits.preview,
            "budget": limits.budget,
            "rubber": None if rubber is None else asdict(rubber),
        }
        try:
            self._process = subprocess.Popen(
                [sys.executable, "-m", "cohaptic_uploads.worker", json.dumps(reported)],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL,
                env=_own_environment() | _ONE_THREAD,
            )
        except OSError:
            self._folder.close()
            raise
        # The worker's priority is lowered only now. If this thread had lowered its own priority
        # before the start, it would hold Python's lock for longer, and a tick would wait for it.
        stand_back(self._process.pid)
        send_text(self._in, name=name)

    @property
    def pid(self) -> int:
        """Process id of the worker."""
        return self._process.pid

    def send_piece(self, piece: bytes) -> None:
        """Pass on a piece of the file; an empty piece ends the file.

        Raises:
            UploadFailed: The process has ended.
        """
        try:
            send(self._in, DATA, piece)
        except PipeEnded as error:
            raise UploadFailed(self._ended()) from error

    def send_wish(self, **wish: Any) -> None:
        """Ask the worker to prepare the object with the visitor's choices.

        Raises:
            UploadFailed: The process has ended.
        """
        try:
            send_text(self._in, **wish)
        except PipeEnded as error:
            raise UploadFailed(self._ended()) from error

    def receive(self) -> tuple[bytes, bytes]:
        """Wait for the worker's next message; returns its kind and its bytes.

        Raises:
            UploadFailed: The process has ended, or has sent bytes that are not a message.
        """
        try:
            return receive(self._out)
        except PipeEnded as error:
            raise UploadFailed(self._ended()) from error

    def kill(self) -> None:
        """Kill the process without waiting for its end."""
        with contextlib.suppress(OSError):
            self._process.kill()

    def close(self) -> None:
        """Kill the process, wait for its end, close the pipes, and remove the worker's files."""
        self.kill()
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._process.wait(_PATIENCE)
        for stream in (self._in, self._out):
            with contextlib.suppress(OSError):
                stream.close()
        give_up(self._folder.path / MARK)
        self._folder.close()

    @property
    def _in(self) -> IO[bytes]:
        assert self._process.stdin is not None
        return self._process.stdin

    @property
    def _out(self) -> IO[bytes]:
        assert self._process.stdout is not None
        return self._process.stdout

    def _ended(self) -> str:
        """Wait for the end of the process; returns the reason, from its exit status."""
        try:
            status = self._process.wait(_PATIENCE)
        except subprocess.TimeoutExpired:
            self.kill()
            return "what reads it says nothing that can be understood"
        limits = self._limits
        memory = f"it takes more memory than an upload may have here, {limits.memory / 1e9:.3g} GB"
        if status == -_SIGXCPU:
            seconds = limits.examine + limits.prepare
            return f"it takes more than {seconds:g} s of the processor, the limit of an upload"
        # Without memory, compiled libraries abort, or crash on the memory that they did not get.
        if status in (TOO_MUCH_MEMORY, -_SIGABRT, -_SIGSEGV):
            return f"{memory}, or breaks what reads it"
        if status in (-_SIGKILL, -_SIGXFSZ):
            return "the system ended what reads it"
        return f"what reads it has ended with status {status}"


def _new_folder(limits: UploadLimits) -> WorkFolder:
    """Make the folder of a new upload; raises UploadFailed if there is no disk space for it."""
    remove_abandoned()
    held, mib = bytes_in_work(limits.file), 2**20
    if held + limits.file > limits.disk:
        raise UploadFailed(
            f"uploads may hold {held / mib:,.0f} MiB of the disk here, and one may need"
            f" {limits.file / mib:g} more; the limit is {limits.disk / mib:,.0f} MiB"
        )
    try:
        return WorkFolder()
    except OSError as error:
        why = error.strerror or type(error).__name__
        raise UploadFailed(f"this server cannot keep the file: {why}") from error
