"""A file to which a room writes what has to outlive its process, without ever waiting for a disk.

A thread of its own writes: a disk that is busy with others' files can hold up even a short write
for longer than a tick. What cannot be written, on a full disk, is tried again.
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
    MOST_REMOVED,
    MOST_USED,
    Record,
    decode,
    encode,
    still_counting,
)

log = logging.getLogger("cohaptic.server")

AGAIN_AFTER = 5.0  # s between two attempts on a disk that takes nothing
# Lines that wait for the disk: more than the budget of joins lets through in ten minutes.
MOST_WAITING = 4096
# Lines after which those that say nothing any more are left out: twice what can count.
_LINES = 2 * (MOST_USED + MOST_REMOVED)
_USED = b'"kind":"used"'
_MOST_OTHERS = 16_384  # lines of who was put out that are read of a file longer than ours
# To read and to add to; Windows would change the ends of lines.
_APPEND: Final = os.O_RDWR | os.O_CREAT | os.O_APPEND | getattr(os, "O_BINARY", 0)
_CLOSING = 1.0  # s for what waits to be written at the end
_MOST_BYTES = 64 * 1024 * 1024  # of a file; `_LINES` of the longest that a server makes have less


class Journal:
    """Journal of one room; nothing but `open` waits for the disk.

    Args:
        folder: For the files of all rooms of a server; made, for its owner alone.
        room: Name of the room.
        lines: After how many lines the file is written anew.
    """

    def __init__(self, folder: Path, room: str, lines: int = _LINES) -> None:
        self._path = folder / f"{room}.jsonl"
        self._clock = SystemClock()
        self._most, self._lines = lines, 0
        self._waiting: queue.Queue[Record | None] = queue.Queue(MOST_WAITING)
        self._unwritten: list[bytes] = []
        self._file = -1
        self._failed = False
        self._lost = False  # whether one is left out already
        self._writer = threading.Thread(target=self._write, name="journal", daemon=True)

    def open(self) -> list[Record]:
        """Read what earlier processes have kept, and keep from now on.

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
        """Write a record soon."""
        try:
            self._waiting.put_nowait(record)
        except queue.Full:
            if not self._lost:
                self._lost = True
                log.warning("%s: not kept any more, %d wait", self._path, MOST_WAITING)

    def close(self) -> None:
        """Write what waits, unless the disk takes too long, and end."""
        with contextlib.suppress(queue.Full):
            self._waiting.put_nowait(None)
        self._writer.join(_CLOSING)

    def _write(self) -> None:
        """What the thread does."""
        going = True
        while going:
            # At a disk that takes nothing there is something to be done even if nobody comes.
            again = AGAIN_AFTER if self._unwritten else None
            with contextlib.suppress(queue.Empty):
                record = self._waiting.get(timeout=again)
                going = record is not None
                if record is not None and len(self._unwritten) < MOST_WAITING:
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
        if self._file < 0:  # it could not be opened again
            self._write_anew()
        while self._unwritten:
            line = self._unwritten[0]
            # The end of a line first: the one before may have been cut short by a full disk.
            line = b"\n" + line if self._failed else line
            if os.write(self._file, line) != len(line):
                raise OSError(0, "the disk is full")
            del self._unwritten[0]
            self._lines += 1
        if self._lines > self._most or not self._in_place():
            self._write_anew()

    def _in_place(self) -> bool:
        """Whether the file is still the one that the next process will find.

        Another server that was given the same folder has put its own there, or somebody who tidies
        up has taken it away.
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
        """Write what counts into another file that takes its place; returns that."""
        self._path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        lines = _lines_at(self._path)
        if self._file >= 0 and not self._in_place():
            # What this process has kept is in no folder any more.
            os.lseek(self._file, 0, os.SEEK_SET)
            with os.fdopen(os.dup(self._file), "rb") as file:
                lines += _newest_lines(file)
        records = dict.fromkeys(one for line in lines if (one := decode(line)) is not None)
        wall = self._clock.now() + self._clock.to_wall()
        counting = still_counting(records, wall)
        # `mkstemp` makes it with mode 0600: who was put out is nobody else's business.
        handle, name = tempfile.mkstemp(prefix=f".{self._path.name}.", dir=self._path.parent)
        try:
            with os.fdopen(handle, "wb") as file:
                file.write(b"".join(map(encode, counting)))
                file.flush()
                os.fsync(file.fileno())
            # Windows moves no file that is open, and puts none in the place of one that is.
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
    # A pipe would be waited for, for ever; a folder has its own error.
    if not (path.is_file() or path.is_dir()):
        raise OSError(0, "it is no file")
    with path.open("rb") as file:
        return _newest_lines(file)


def _newest_lines(file: BinaryIO) -> list[bytes]:
    """The end of a file that is longer than any of ours: that is what was written last.

    To look for a word in a line takes a tenth of a microsecond, and to read it ten: a file of a
    million lines would keep a room closed for as long. Who was put out counts from further back.
    """
    size = os.fstat(file.fileno()).st_size
    file.seek(max(0, size - _MOST_BYTES))
    lines = file.read(_MOST_BYTES).split(b"\n")
    if len(lines) <= _LINES:
        return lines
    used = [line for line in lines if _USED in line]
    others = [line for line in lines if _USED not in line]
    return used[-_LINES:] + others[-_MOST_OTHERS:]
