"""Takes the entries of a session while it goes on, and writes them in a thread.

The caller appends to a list and goes on; neither a slow disk nor a full one can hold a server up.
What a slow disk cannot take is left out, and the file says how much.
"""

from __future__ import annotations

import math
import threading
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path

from cohaptic.errors import OutputError, SettingError, one_line
from cohaptic.room_address import is_room_name
from cohaptic.sessions.entries import LeftOut, SessionInfo, Written, size_of
from cohaptic.sessions.writer import SessionFile

# Bytes of entries that may wait for the disk: some ten seconds of eight people at 1 kHz.
WAITING = 64 * 1024 * 1024
# s of a session after which the thread is woken. What came meanwhile takes one or two milliseconds
# to encode, for which a server's tick may have to wait; more at once would make a tick late.
BATCH = 0.02
# s without a new entry after which the thread looks by itself, so that a chunk is not left open
# while a room is at rest.
_LOOK = 0.5
# Bytes after which the system is asked to bring all to the disk: some seconds of eight people.
_SYNC = 4 * 1024 * 1024
# s in which a disk takes nothing, after which its last entries are given up: whoever ends a server
# must not wait for ever.
_PATIENCE = 10.0
SUFFIX = ".mcap"
_MOST_OF_A_NAME = 100  # recordings of one second; a further one is refused


class SessionRecorder:
    """Records a session to a file.

    Args:
        path: Path of the MCAP file, which must not exist.
        info: First entry of the session.
        tell: Function that shows the operator a sentence; another thread calls it.
        option: Option by which the operator named the file.
        waiting: Bytes of entries that may wait for the disk.
        plots: Whether the file also has the messages for Foxglove.
        batch: Time of the session after which the thread is woken [s]; None if the caller does it
            by `wake`, as a server after its tick, which must not wait for the thread.

    Raises:
        SettingError: There is a file of that name, or it cannot be made.
        OutputError: Its first bytes cannot be written.
    """

    def __init__(
        self,
        path: Path,
        info: SessionInfo,
        *,
        tell: Callable[[str], None],
        option: str = "--record",
        waiting: int = WAITING,
        plots: bool = True,
        batch: float | None = BATCH,
    ) -> None:
        self._batch = math.inf if batch is None else batch
        self.path, self._tell, self._most = path, tell, waiting
        try:
            self._file = SessionFile(option, path, info, plots=plots)
        except OSError as error:
            raise OutputError(path, f"it cannot be written ({_cause(error)})") from error
        self._waiting: list[tuple[Written, int]] = []  # with its size
        self._size = 0  # bytes of entries that wait
        self._woken: float = -math.inf  # time of the entry that last woke the thread [s]
        self._newest = info.t
        self._left_out = 0  # entries since the last that was taken
        self._all_left_out = 0
        self._refused = 0  # entries that cannot be represented
        self._unsynced = 0
        self._closing = False
        self._due = False  # whether the thread is to look
        self._trouble: Exception | None = None
        self._kept: Path | None = path
        self._changed = threading.Condition()
        # A daemon, so that a disk that never answers does not keep a process from its end.
        self._thread = threading.Thread(target=self._run, name="session", daemon=True)
        self._thread.start()

    @property
    def ended(self) -> bool:
        """Whether the recording has ended by itself, as `tell` was told."""
        return self._trouble is not None

    @property
    def left_out(self) -> int:
        """Number of entries that are not in the file."""
        return self._all_left_out + self._refused

    def add(self, entry: Written) -> None:
        """Add an entry without waiting; it does not fail, whatever has become of the file."""
        try:
            size, due = size_of(entry), not abs(entry.t - self._woken) < self._batch
        except Exception:  # a fault of who made the entry, of which the thread tells
            size, due = 0, True
        with self._changed:
            if self._trouble is not None or self._closing:
                return
            if self._size + size > self._most:
                self._left_out += 1
                self._all_left_out += 1
                first = self._all_left_out == 1
                self._wake()
            else:
                first = False
                if self._left_out:
                    self._waiting.append((LeftOut(entry.t, self._left_out), 0))
                    self._left_out = 0
                self._waiting.append((entry, size))
                self._size += size
                if due:
                    self._woken = entry.t
                    self._wake()
        if first:
            self._tell(f"the disk is too slow for the recording {self.path}: it lacks something")

    def wake(self) -> None:
        """Have the thread write what waits, without waiting for it."""
        with self._changed:
            self._wake()

    def _wake(self) -> None:
        self._due = True
        self._changed.notify()

    def finish(self) -> str:
        """Write what waits, and the index; return a sentence that says what was recorded where.

        Raises:
            OutputError: The recording ended before its time; the error says what is left.
        """
        with self._changed:
            self._closing = True
            self._wake()
        while self._thread.is_alive():
            size = self._size
            self._thread.join(_PATIENCE)
            if self._thread.is_alive() and self._size == size:
                problem = f"its disk has not answered for {_PATIENCE:g} s"
                raise OutputError(self.path, problem, "what it took before is in the file")
        if self._trouble is None:
            try:
                if self._left_out:
                    self._file.add(LeftOut(self._newest, self._left_out))
                self._file.close()
            except OSError as error:
                self._give_up(error)
        if self._trouble is not None:
            left = f"what there is is kept in {self._kept}" if self._kept else "all of it is lost"
            problem = f"the recording ended before the session ({_cause(self._trouble)})"
            raise OutputError(self.path, problem, left)
        missing = f"; {self.left_out} entries are left out" if self.left_out else ""
        return f"recorded to {self.path}{missing}"

    def _run(self) -> None:
        while True:
            with self._changed:
                still = not (self._due or self._closing) and not self._changed.wait(_LOOK)
                self._due = False
                waiting, self._waiting = self._waiting, []
                closing = self._closing
            try:
                self._write(waiting, still=still)
            except Exception as error:  # whatever it is, entries are lost by it
                self._give_up(error)
                return
            if closing and not waiting:
                return

    def _write(self, waiting: list[tuple[Written, int]], *, still: bool) -> None:
        """Write entries; without any, and `still`, end the chunk: the room may be at rest."""
        if still and not waiting:
            self._file.flush()
        for entry, size in waiting:
            try:
                self._file.add(entry)
                self._newest = entry.t
            except OSError:
                raise
            except Exception as error:  # a fault of who made the entry
                self._refuse(entry, error)
            with self._changed:
                self._size -= size
            self._unsynced += size
        if self._unsynced >= _SYNC:
            self._file.part.sync()
            self._unsynced = 0

    def _refuse(self, entry: Written, error: Exception) -> None:
        """Leave out an entry that no file can hold, and say so, the first time to people too."""
        self._refused += 1
        self._file.add(LeftOut(self._newest, 1))
        if self._refused == 1:
            kind = type(entry).__name__
            why = one_line(str(error))
            self._tell(f"the recording {self.path} lacks an entry of kind {kind}: {why}")

    def _give_up(self, error: Exception) -> None:
        """End the recording, keep what there is, and say so at once; the session goes on."""
        with self._changed:
            self._trouble, self._waiting = error, []
        part = self._file.part
        if not part.is_there():
            try:
                self._kept = part.rescue()
            except OSError:
                self._kept = None
        part.close()
        kept = f"what there is is kept in {self._kept}" if self._kept else "all of it is lost"
        cause = _cause(error)
        self._tell(
            f"the recording {self.path} ends here ({cause}), and the session goes on; {kept}"
        )


def open_recorder(
    target: str,
    info: SessionInfo,
    tell: Callable[[str], None],
    option: str = "--record",
    batch: float | None = BATCH,
) -> SessionRecorder:
    """Make the file of a recording; the call waits for the disk.

    Args:
        target: Path of the file, which ends in `.mcap` and must not exist; or of a folder, in which
            the file gets a name of its own.
        info: First entry.
        tell: Function that shows the operator a sentence; another thread calls it.
        option: Option by which the operator named the target.
        batch: As for `SessionRecorder`.

    Raises:
        SettingError: The file exists, or cannot be made.
        OutputError: Its first bytes cannot be written.
    """
    if not target:
        raise SettingError(option, target, "the name of a file or of a folder")
    path = Path(target)
    if path.suffix == SUFFIX and not path.is_dir():
        return SessionRecorder(path, info, tell=tell, option=option, batch=batch)
    if path.suffix and not path.exists():
        limit = f"a file that ends in {SUFFIX}, or a folder that exists"
        raise SettingError(option, target, limit)
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise SettingError(option, target, f"a folder ({error.strerror})") from error
    begun = datetime.fromtimestamp(info.t + info.to_wall, UTC).strftime("%Y-%m-%dT%H-%M-%S")
    for k in range(1, _MOST_OF_A_NAME):
        # A server somewhere may call its room as it likes: a name must not lead out of the folder.
        room = info.room if is_room_name(info.room) else "room"
        name = f"{room}-{begun}{f'-{k}' if k > 1 else ''}{SUFFIX}"
        if not (path / name).exists():
            try:
                return SessionRecorder(path / name, info, tell=tell, option=option, batch=batch)
            except SettingError:
                if not (path / name).exists():  # nobody was faster: the folder is at fault
                    raise
    raise SettingError(option, target, f"fewer than {_MOST_OF_A_NAME} recordings in one second")


def _cause(error: Exception) -> str:
    """Return an error as a phrase."""
    return str(getattr(error, "strerror", None) or error or type(error).__name__)
