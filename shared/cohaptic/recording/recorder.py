"""Takes the rows of a client while they are made, and writes them to a part in a thread.

The caller never waits: a slow disk holds up neither the network nor the heartbeats of the haptic
loop. What a slow disk cannot take is left out, and is a gap in the recording.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping
from pathlib import Path

from cohaptic.errors import OutputError, SettingError
from cohaptic.recording.journal import (
    LARGEST,
    Clocks,
    Header,
    RowBlock,
    clocks_block,
    header_block,
    rows_block,
)
from cohaptic.recording.part import Part, finish_command, part_gone
from cohaptic.status.row import ROW, columns_with, last_row
from cohaptic.vec import ZERO, Vec3

# Bytes of rows that may wait for the disk: a minute and a half at 1 kHz.
WAITING = 32 * 1024 * 1024
# Bytes after which the system is asked to bring all to the disk, so that a loss of power loses
# little: some seconds at 1 kHz. A process that is killed loses nothing that was written.
_SYNC = 256 * 1024
_LONG = 16 * 1024 * 1024  # bytes of a part of three minutes, which take a second to be turned
_SPLIT = LARGEST // ROW.size * ROW.size


class NothingRecorded(OutputError):
    """The user wished a recording, and there was not one haptic period to record."""

    def __init__(self, path: Path) -> None:
        super().__init__(path, "nothing was recorded: the hand was never there; no file was made")


class Recorder:
    """Records a client to a file.

    Args:
        path: Path of the `.npz`, which is made at the end.
        name: Name of the user.
        loop_hz: Rows per second [Hz].
        overwrite: Whether the `.npz` may replace a file.
        tell: Function that shows the user a sentence; another thread calls it.
        rules: Rules of other packages in the loop, and the reason of each.

    Raises:
        SettingError: The part cannot be made, or another program records to it.
    """

    def __init__(
        self,
        path: Path,
        *,
        name: str,
        loop_hz: float,
        overwrite: bool,
        tell: Callable[[str], None],
        rules: Mapping[str, str] | None = None,
    ) -> None:
        self._path, self._overwrite, self._tell = path, overwrite, tell
        self._part = Part.claim("--record", path)
        # An empty part is nobody's data: nothing is written before the first row.
        self._header: bytes | None = header_block(
            Header(name, columns_with(list(rules or {})), loop_hz, dict(rules or {}))
        )
        self._waiting: list[RowBlock | Clocks] = []
        self._size = 0  # bytes of rows that wait or are being written
        self._unsynced = 0
        self._rows = self._with_object = False  # whether there is a row, and one with a patch
        self._slow = False  # whether rows were left out, which is told once
        self._closing = False
        self._count = 0  # rows that were written
        self._trouble: Exception | None = None
        self._kept: Path | None = self._part.path
        self._changed = threading.Condition()
        # A daemon, so that a disk that never answers does not keep a process from its end.
        self._thread = threading.Thread(target=self._run, name="recording", daemon=True)
        self._thread.start()

    def keep(self, rows: bytes, origin: Vec3 = ZERO) -> None:
        """Add rows without waiting.

        Args:
            rows: Rows of `cohaptic.status.row.ROW`, one behind the other.
            origin: Origin of the rows' frame, as a point of the scaled file of the object [m].
        """
        for start in range(0, len(rows), _SPLIT):
            self._add(RowBlock(origin, rows[start : start + _SPLIT]))

    def note(self, clocks: Clocks) -> None:
        """Add the state of the clocks; before the first row this does nothing."""
        self._add(clocks)

    def finish(self) -> str:
        """Write what waits, and turn the part into the `.npz`; this may take seconds.

        Returns:
            A sentence that says what was recorded where.

        Raises:
            NothingRecorded: There was no row; nothing is left behind.
            OutputError: The recording ended before its time or cannot be turned, and stays in a
                part, of which the error tells; or no row has a patch of the object.
        """
        # Here, so that a client starts without numpy.
        from cohaptic.recording.archive import finish
        from cohaptic.recording.outline import extent_in_words

        with self._changed:
            self._closing = True
            self._changed.notify()
        self._thread.join()
        if not self._rows:
            self._part.remove()
            raise NothingRecorded(self._path)
        if self._trouble is None and not self._part.is_there():  # since the last write
            self._give_up(part_gone())
        if self._trouble is not None:
            self._part.close()
            raise OutputError(self._path, *self._what_is_left(self._trouble))
        if self._part.size() > _LONG:
            self._tell(f"writing {self._path}, which takes some seconds")
        outline = finish(self._part, self._path, overwrite=self._overwrite, least=self._count)
        if outline.count < self._count:
            lost = f"{self._count - outline.count} of {self._count} rows are lost"
            problem = f"{lost}: another program has changed {self._part.path}"
            raise OutputError(self._path, problem, "the others were recorded")
        words = f"recorded to {self._path}: {extent_in_words(outline)}"
        if not self._with_object:
            raise OutputError(self._path, "the object was never there", words)
        return words

    def _add(self, entry: RowBlock | Clocks) -> None:
        with self._changed:
            if isinstance(entry, RowBlock):
                self._rows = True
                self._with_object = self._with_object or last_row(entry.rows).tick > 0.0
            if self._trouble is not None or self._closing or not self._rows:
                return
            left_out = self._size + _size(entry) > WAITING
            reported, self._slow = self._slow, self._slow or left_out
            if not left_out:
                self._waiting.append(entry)
                self._size += _size(entry)
                self._changed.notify()
        if left_out and not reported:
            self._tell(f"the disk is too slow for the recording {self._path}: it will have a gap")

    def _run(self) -> None:
        while True:
            with self._changed:
                while not self._waiting and not self._closing:
                    self._changed.wait()
                waiting, self._waiting = self._waiting, []
            if not waiting:
                return
            for entry in waiting:
                try:
                    self._write(entry)
                except Exception as error:  # whatever it is, rows are lost by it
                    self._give_up(error)
                    return
                with self._changed:
                    self._size -= _size(entry)

    def _write(self, entry: RowBlock | Clocks) -> None:
        # Here, in the thread, because compressing takes longer than the network should wait.
        data = rows_block(entry) if isinstance(entry, RowBlock) else clocks_block(entry)
        if self._header is not None:
            data, self._header = self._header + data, None
        self._part.write(data)
        self._count += _size(entry) // ROW.size
        self._unsynced += len(data)
        if self._unsynced >= _SYNC:
            self._part.sync()
            self._unsynced = 0

    def _give_up(self, error: Exception) -> None:
        """End the recording, keep what there is, and say so at once; the hand goes on."""
        with self._changed:
            self._trouble, self._waiting = error, []
        if not self._part.is_there():
            try:
                self._kept = self._part.rescue()
            except OSError:
                self._kept = None
        kept = f"what there is is kept in {self._kept}" if self._kept else "all of it is lost"
        self._tell(
            f"the recording {self._path} ends here ({_cause(error)}), and the hand goes on; {kept}"
        )

    def _what_is_left(self, error: Exception) -> tuple[str, str]:
        """Return what ended the recording, and what is left of it, as for `OutputError`."""
        from cohaptic.recording.archive import read_outline
        from cohaptic.recording.outline import extent_in_words

        problem = f"the recording ended before the hand did ({_cause(error)})"
        if self._kept is None:
            return problem, "all of it is lost"
        try:
            extent = extent_in_words(read_outline(self._kept))
        except SettingError as unreadable:
            return problem, str(unreadable)
        return problem, (
            f"{extent}, are kept in {self._kept}; where there is room, turn it into a .npz by: "
            f"{finish_command(self._kept)}"
        )


def _cause(error: Exception) -> str:
    """Return an error as a phrase."""
    return str(getattr(error, "strerror", None) or error or type(error).__name__)


def _size(entry: RowBlock | Clocks) -> int:
    """Return the bytes of rows of an entry."""
    return len(entry.rows) if isinstance(entry, RowBlock) else 0
