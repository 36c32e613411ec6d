"""The server's end of a worker: start it, speak with it, and end it.

Every call but `kill` may wait, so a thread of its own makes them, one at a time.
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
from cohaptic_uploads.confine import TOO_MUCH_MEMORY
from cohaptic_uploads.kept_files import MARK, give_up
from cohaptic_uploads.limits import UploadLimits
from cohaptic_uploads.pipe import DATA, PipeEnded, receive, send, send_text
from cohaptic_uploads.work_folder import WorkFolder, bytes_in_work, remove_abandoned

_PATIENCE = 5.0  # s for a process that was killed to be gone
_SIGXCPU, _SIGXFSZ, _SIGABRT, _SIGSEGV, _SIGKILL = 24, 25, 6, 11, 9  # as Linux numbers them
# In its own thread pools a library would reserve memory for each core.
_ONE_THREAD = dict.fromkeys(
    ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS"), "1"
)


@dataclass(frozen=True, slots=True)
class Rubber:
    """What `build_affordable` makes a nonlinear solid with.

    Args:
        period: Period of the simulation, in which it must be solved for two users [s].
        damping: B_o over K_o.
    """

    period: float
    damping: float


class UploadFailed(CohapticError):
    """An upload came to nothing, and why."""


class WorkerProcess:
    """A worker that runs.

    Args:
        limits: Limits of the upload.
        name: Name of the visitor's file.
        rubber: What makes a nonlinear solid of it; None makes a linear one.

    Raises:
        UploadFailed: All uploads together hold too much of the disk, or it has no more room.
    """

    def __init__(self, limits: UploadLimits, name: str, rubber: Rubber | None = None) -> None:
        self._limits = limits
        self._folder = _new_folder(limits)
        told = {
            "folder": str(self._folder.path),
            "memory": limits.memory,
            "cpu": limits.examine + limits.prepare,
            "preview": limits.preview,
            "budget": limits.budget,
            "rubber": None if rubber is None else asdict(rubber),
        }
        try:
            self._process = subprocess.Popen(
                [sys.executable, "-m", "cohaptic_uploads.worker", json.dumps(told)],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL,
                env=os.environ | _ONE_THREAD,
            )
        except OSError:
            self._folder.close()
            raise
        # Only now, and not this thread before: until the child runs its own program this thread
        # holds Python's lock, and a tick would wait for whatever the two of them wait for.
        stand_back(self._process.pid)
        send_text(self._in, name=name)

    @property
    def pid(self) -> int:
        """Number of the process."""
        return self._process.pid

    def send_piece(self, piece: bytes) -> None:
        """Pass on a piece of the file; an empty one ends it.

        Raises:
            UploadFailed: The process has ended.
        """
        try:
            send(self._in, DATA, piece)
        except PipeEnded as error:
            raise UploadFailed(self._ended()) from error

    def send_wish(self, **wish: Any) -> None:
        """Ask it to prepare the object.

        Raises:
            UploadFailed: The process has ended.
        """
        try:
            send_text(self._in, **wish)
        except PipeEnded as error:
            raise UploadFailed(self._ended()) from error

    def receive(self) -> tuple[bytes, bytes]:
        """Its next message.

        Raises:
            UploadFailed: The process has ended, or says what it may not.
        """
        try:
            return receive(self._out)
        except PipeEnded as error:
            raise UploadFailed(self._ended()) from error

    def kill(self) -> None:
        """End it now, whatever it does; does not wait."""
        with contextlib.suppress(OSError):
            self._process.kill()

    def close(self) -> None:
        """End it, wait for its end, close the pipes, and remove what it has left behind."""
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
        """Why it has ended, as far as that can be known."""
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
        # Where memory cannot be had, compiled libraries abort, or use what they did not get.
        if status in (TOO_MUCH_MEMORY, -_SIGABRT, -_SIGSEGV):
            return f"{memory}, or breaks what reads it"
        if status in (-_SIGKILL, -_SIGXFSZ):
            return "the system ended what reads it"
        return f"what reads it has ended with status {status}"


def _new_folder(limits: UploadLimits) -> WorkFolder:
    """A folder for one more upload."""
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
