"""Runs the processes of a demonstration: a server and a client for each user, on loopback.

Each process is the ordinary `cohaptic serve` or `cohaptic touch` with a pipe as its lifeline: the
process ends by itself when the pipe closes, which also happens if this process dies.
"""

from __future__ import annotations

import contextlib
import math
import subprocess
import sys
import threading
from collections.abc import Callable, Sequence
from pathlib import Path
from types import TracebackType

from pydantic import ValidationError

from cohaptic.errors import CohapticError
from cohaptic.recording.part import part_of
from cohaptic.simulated.hand import HandScript
from cohaptic.simulated.networks import words_for
from cohaptic.status.report import TouchStatus
from cohaptic.vec import Vec3, add
from cohaptic_tools.demo.scene import Scene

_START = 30.0  # s between two reports that a process is still starting
_JOIN = 20.0  # s for which a client tries to reach the server
_END = 8.0  # s within which a process must end by itself
# Bytes of a part that a client turns into a .npz in a second, with all clients at it on a slow
# machine: a tenth of what one alone does.
_TURNED = 1.5e6


class DemoFailed(CohapticError):
    """Error: a process of the demonstration has failed."""


class Process:
    """A running subcommand of cohaptic with a lifeline; a thread reads its output.

    Args:
        arguments: Name of the subcommand, and its options.
        log: File for the standard error of the process.

    Attributes:
        first: First line of standard output; empty before there is one.
        line: Newest line of standard output; empty before there is one.
    """

    def __init__(self, *arguments: str, log: Path) -> None:
        self.first = self.line = ""
        self._log = log
        self._first = threading.Event()
        with log.open("wb") as errors:
            self._process = subprocess.Popen(
                [sys.executable, "-m", "cohaptic", *arguments, "--lifeline"],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=errors,
                # Ctrl-C then reaches only the parent, which ends its children in order.
                start_new_session=True,
            )
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self) -> None:
        assert self._process.stdout is not None
        for raw in self._process.stdout:
            self.line = raw.decode(errors="replace").strip()
            self.first = self.first or self.line
            self._first.set()
        self._first.set()

    def first_line(self, tell: Callable[[str], None] = lambda words: None) -> str:
        """Wait for the first line of output, and return it; there is no time-out.

        The wait may take minutes: if the object of a server could not be stored, the server
        prepares the object once more.

        Args:
            tell: Called with a sentence every `_START` while the process is still starting.

        Raises:
            DemoFailed: The process ended without output; the error quotes the last line of its log.
        """
        while not self._first.wait(_START):
            tell(f"waiting for a process that is still starting: {self.words() or 'no word yet'}")
        if not self.first:
            raise DemoFailed(f"a process did not start: {self.words() or 'no word from it'}")
        return self.first

    def words(self) -> str:
        """Return the last line of the process's log; empty if there is none."""
        lines = self._log.read_text(errors="replace").strip().splitlines()
        return lines[-1] if lines else ""

    @property
    def running(self) -> bool:
        """Whether the process is still running."""
        return self._process.poll() is None

    @property
    def pid(self) -> int:
        """Process id."""
        return self._process.pid

    def let_end(self) -> None:
        """Close the lifeline, so that the process ends by itself."""
        assert self._process.stdin is not None
        with contextlib.suppress(OSError):
            self._process.stdin.close()

    def wait(self, longest: float = _END) -> None:
        """Close the lifeline and wait for the end; kill the process if it does not end in time.

        Args:
            longest: Time within which the process must end by itself [s].
        """
        self.let_end()
        try:
            self._process.wait(longest)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        self._reader.join(1.0)
        if self._process.stdout is not None:
            self._process.stdout.close()


class Stage:
    """Context in which all processes of a scene run; at its end the clients end, then the server.

    Args:
        scene: Scene that the users perform.
        folder: Folder for recordings and logs.
        body: Options of `cohaptic serve` that describe the touched body.
        tell: Called with a sentence if the start of the server takes long.
        overwrite: Whether recordings may replace those that are in the folder.

    Attributes:
        users: Processes of the clients, by name.
        server: Process of the server.
        url: URL of the server; empty before its start.
    """

    def __init__(
        self,
        scene: Scene,
        folder: Path,
        body: Sequence[str] = (),
        tell: Callable[[str], None] = lambda words: None,
        *,
        overwrite: bool = False,
    ) -> None:
        self._scene, self._folder, self._tell = scene, folder, tell
        self._overwrite = ["--overwrite"] if overwrite else []
        self._before = {name: _identity(self.recording(name)) for name in scene.names}
        self.users: dict[str, Process] = {}
        self.server = Process(
            "serve", "--port", "0", "--quiet", "--simulation-hz", f"{scene.simulation_hz:g}",
            # The tour of the page shows unstable settings; only this machine can reach the server.
            "--allow-latency", "--allow-fixed-gains",
            *body,
            log=folder / "server.log",
        )  # fmt: skip
        self.url = ""

    def __enter__(self) -> Stage:
        try:
            self.url = self.server.first_line(self._tell).removeprefix("listening ")
            for user in range(self._scene.users):
                self.add_user(user)
        except BaseException:
            self.close()
            raise
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def add_user(self, user: int) -> Process:
        """Start the client of user number `user` (from 0)."""
        scene, script = self._scene, self._scene.script(user)
        name = scene.names[user]
        process = Process(
            "touch", self.url,
            "--name", name,
            "--law", scene.law.value,
            # A plane is enough for hands that do not slide, and takes the least time.
            "--geometry", "plane",
            # A busy server may answer slowly at first; the end of the server is detected elsewhere.
            "--wait", f"{_JOIN:g}",
            "--network", words_for(scene.link),
            "--seed", str(scene.seed + user),
            *placement_options(script, scene.origin),
            "--depth-mm", repr(1e3 * script.depth),
            "--rhythm-s", repr(script.rhythm.period if script.rhythm else 0.0),
            "--drag-mm", repr(1e3 * script.drag),
            "--friction", repr(scene.friction),
            "--record", str(self.recording(name)), *self._overwrite,
            "--json-lines",
            log=self._folder / f"{name}.log",
        )  # fmt: skip
        self.users[name] = process
        return process

    def recording(self, name: str) -> Path:
        """Return the path of a user's recording, which the client writes at its end."""
        return self._folder / f"{name}.npz"

    def recorded(self, name: str) -> bool:
        """Return whether a user's recording is there, and not that of an earlier demonstration."""
        return _identity(self.recording(name)) not in (None, self._before[name])

    def statuses(self) -> list[TouchStatus]:
        """Return the current status of each user."""
        return [self._status(name, process) for name, process in self.users.items()]

    @staticmethod
    def _status(name: str, process: Process) -> TouchStatus:
        if not process.running:
            return TouchStatus(name=name, state=f"gone: {process.words()}")
        try:
            return TouchStatus.model_validate_json(process.line or "{}")
        except ValidationError:
            return TouchStatus(name=name, state="connecting")

    def close(self) -> None:
        """End every client, then the server."""
        for process in self.users.values():
            process.let_end()
        for name, process in self.users.items():
            part = part_of(self.recording(name))
            size = part.stat().st_size if part.exists() else 0
            process.wait(_END + size / _TURNED)
        self.server.wait()


def _identity(path: Path) -> tuple[int, int] | None:
    """Return what tells one file of a name from the next; None if there is none."""
    try:
        found = path.stat()
    except OSError:
        return None
    return found.st_ino, found.st_mtime_ns


def placement_options(script: HandScript, origin: Vec3) -> list[str]:
    """Return the options of `cohaptic touch` that say where a hand stands in the object's file.

    Args:
        origin: Origin of the frame of the script's place, as a point of the file [m].
    """
    if script.place is None:
        return ["--angle", repr(math.degrees(script.angle))]
    at, inward = map(repr, add(script.place.point, origin)), map(repr, script.place.inward)
    return ["--at", *at, "--inward", *inward]
