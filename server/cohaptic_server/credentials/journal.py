"""Stores the records of a room that must outlive its process; the room never waits for the disk.

A separate thread writes, since a disk that is busy with other files can delay even a short write
for longer than a tick. The thread tries again to write a record that could not be written, for
example on a full disk.
"""

from __future__ import annotations

import contextlib
import logging
import os
import queue
import tempfile
import threading
from pathlib import Path
from typing import BinaryIO, Final

from cohaptic.clock import SystemClock
from cohaptic.errors import SettingError, one_line
from cohaptic_server.access.remembered import (
    MAX_REMOVED,
    MAX_USED,
    Record,
    decode,
    encode,
    still_counting,
)

log = logging.getLogger("cohaptic.server")

AGAIN_AFTER = 5.0  # s between two attempts while writes to the disk fail
# Lines that wait for the disk: more than the rate limit of joins permits in ten minutes.
MAX_WAITING = 4096
# Number of lines after which the file is rewritten without outdated lines: twice the largest number
# of lines that can still have an effect.
_LINES = 2 * (MAX_USED + MAX_REMOVED)
_USED = b'"kind":"used"'
_MAX_OTHERS = 16_384  # lines about removals and pardons that are read from a file that is too long
# Read and append; O_BINARY, since Windows would otherwise change the ends of lines.
_APPEND: Final = os.O_RDWR | os.O_CREAT | os.O_APPEND | getattr(os, "O_BINARY", 0)
_CLOSING = 1.0  # s for writing the waiting records at the end
_MAX_BYTES = 64 * 1024 * 1024  # of a file; more than `_LINES` lines of the greatest length need


class Journal:
    """The journal of one room; only `open`, and for a short time `close`, wait for the disk.

    Args:
        folder: Folder with the files of all rooms of a server; created for its owner alone.
        room: Name of the room.
        lines: Number of lines after which the file is rewritten.
    """

    def __init__(self, folder: Path, room: str, lines: int = _LINES) -> None:
        self._path = folder / f"{room}.jsonl"
        self._clock = SystemClock()
        self._limit, self._lines = lines, 0
        self._waiting: queue.Queue[Record | None] = queue.Queue(MAX_WAITING)
        self._unwritten: list[bytes] = []
        self._file = -1
        self._failed = False
        self._lost = False  # whether a record was dropped already
        self._writer = threading.Thread(target=self._write, name="journal", daemon=True)

    def open(self) -> list[Record]:
        """Return the records of earlier processes that still count, and start the writing thread.

        Raises:
            SettingError: The file cannot be read or written.
        """
        try:
            records = self._write_anew()
        except OSError as error:
            limit = f"one that can be read and written ({error.strerror})"
            raise SettingError("state file", self._path, limit) from error
        self._writer.start()
        return records

    def keep(self, record: Record) -> None:
        """Queue a record for the writing thread; beyond `MAX_WAITING` records it is dropped."""
        try:
            self._waiting.put_nowait(record)
        except queue.Full:
            if not self._lost:
                self._lost = True
                log.warning("%s: not kept any more, %d wait", self._path, MAX_WAITING)

    def close(self) -> None:
        """Let the thread write the queued records and end; wait for it at most `_CLOSING` [s]."""
        with contextlib.suppress(queue.Full):
            self._waiting.put_nowait(None)
        self._writer.join(_CLOSING)

    def _write(self) -> None:
        """Run the writing thread: write queued records until `close`."""
        going = True
        while going:
            # While writes fail, the thread has to try again even if no new record arrives.
            again = AGAIN_AFTER if self._unwritten else None
            with contextlib.suppress(queue.Empty):
                record = self._waiting.get(timeout=again)
                going = record is not None
                if record is not None and len(self._unwritten) < MAX_WAITING:
                    self._unwritten.append(encode(record))
            try:
                self._write_out()
            except OSError as error:
                self._tell(error)
            else:
                if self._failed:
                    log.warning("%s is written again", self._path)
                self._failed = False
        if self._file >= 0:
            os.close(self._file)

    def _write_out(self) -> None:
        if self._file < 0:  # the file could not be opened again
            self._write_anew()
        while self._unwritten:
            line = self._unwritten[0]
            # An end of line comes first, since a full disk may have cut the previous line short.
            line = b"\n" + line if self._failed else line
            if os.write(self._file, line) != len(line):
                raise OSError(0, "the disk is full")
            del self._unwritten[0]
            self._lines += 1
        if self._lines > self._limit or not self._in_place():
            self._write_anew()

    def _in_place(self) -> bool:
        """Check whether the open file is still the file that the next process will find.

        Another server with the same folder may have replaced the file, or somebody may have deleted
        it.
        """
        try:
            there, mine = self._path.stat(), os.fstat(self._file)
        except FileNotFoundError:
            return False
        return (there.st_dev, there.st_ino) == (mine.st_dev, mine.st_ino)

    def _tell(self, error: OSError) -> None:
        if not self._failed:
            why = one_line(error.strerror or str(error))
            log.warning(
                "%s cannot be written (%s): bans and used tokens are lost if the room ends now",
                self._path, why,
            )  # fmt: skip
        self._failed = True

    def _write_anew(self) -> list[Record]:
        """Rewrite the file with only the records that still have an effect, and return these."""
        self._path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        lines = _lines_at(self._path)
        if self._file >= 0 and not self._in_place():
            # The open file, with the records of this process, is no longer in the folder.
            os.lseek(self._file, 0, os.SEEK_SET)
            with os.fdopen(os.dup(self._file), "rb") as file:
                lines += _newest_lines(file)
        records = dict.fromkeys(one for line in lines if (one := decode(line)) is not None)
        wall = self._clock.now() + self._clock.to_wall()
        counting = still_counting(records, wall)
        # `mkstemp` creates mode 0600, since the list of removed users is private.
        handle, name = tempfile.mkstemp(prefix=f".{self._path.name}.", dir=self._path.parent)
        try:
            with os.fdopen(handle, "wb") as file:
                file.write(b"".join(map(encode, counting)))
                file.flush()
                os.fsync(file.fileno())
            # Windows neither moves nor replaces a file that is open.
            if self._file >= 0:
                os.close(self._file)
                self._file = -1
            os.replace(name, self._path)
        except BaseException:
            with contextlib.suppress(FileNotFoundError):
                os.unlink(name)
            raise
        finally:
            if self._file < 0:
                self._file = os.open(self._path, _APPEND, 0o600)
        self._lines = len(counting)
        return counting


def _lines_at(path: Path) -> list[bytes]:
    if not path.exists():
        return []
    # Reading a pipe could wait for ever; opening a folder gives its own error.
    if not (path.is_file() or path.is_dir()):
        raise OSError(0, "it is no file")
    with path.open("rb") as file:
        return _newest_lines(file)


def _newest_lines(file: BinaryIO) -> list[bytes]:
    """Return all lines of a file, or the last ones if the file is longer than a server writes.

    Searching a line for a word takes 0.1 us and parsing a line takes 10 us, so a file of a million
    lines would delay the opening of a room. If lines are left out, the last lines about used tokens
    and the last lines about removals are chosen separately.
    """
    size = os.fstat(file.fileno()).st_size
    file.seek(max(0, size - _MAX_BYTES))
    lines = file.read(_MAX_BYTES).split(b"\n")
    if len(lines) <= _LINES:
        return lines
    used = [line for line in lines if _USED in line]
    others = [line for line in lines if _USED not in line]
    return used[-_LINES:] + others[-_MAX_OTHERS:]
