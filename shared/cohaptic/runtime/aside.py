"""Text for a terminal or a pipe that is written by a thread of its own: nobody waits for a reader.

A terminal that is stopped (Ctrl-S, a pane that is paused) and a pipe that is full let a write wait
for as long as that lasts. What waits here is bounded. What does not fit is left out and counted,
and the reader is told so once it reads again.
"""

from __future__ import annotations

import errno
import io
import os
import threading
from collections import deque
from collections.abc import Callable
from typing import TextIO

MOST = 256 * 1024  # bytes that wait for a reader
LAST_WORDS = 1.0  # s at the most for the end of a program to wait for its reader


def in_words(lines: int) -> str:
    """Words on what was left out."""
    return f"{lines} lines were left out here: nobody read them in time\n"


def aside(
    stream: TextIO, most: int = MOST, tell: Callable[[int], str] = in_words
) -> Aside | TextIO:
    """What to write to in place of a stream; the same where it is no file of the system's.

    Args:
        stream: Stream of a terminal, a pipe or a file.
        most: Bytes that may wait.
        tell: Makes the text for a reader from the number of lines that were left out.
    """
    try:
        stream.flush()
        return Aside(stream.fileno(), stream.encoding or "utf-8", most, tell)
    except (OSError, ValueError, AttributeError):  # in a test, or it is closed
        return stream


class Aside(io.TextIOBase):
    """Writes one file aside.

    Args:
        file: Its number; it stays open.
        encoding: Encoding of the text.
        most: Bytes that may wait.
        tell: As for `aside`.

    Attributes:
        left_out: Lines so far.
    """

    def __init__(
        self,
        file: int,
        encoding: str = "utf-8",
        most: int = MOST,
        tell: Callable[[int], str] = in_words,
    ) -> None:
        self.left_out = 0
        self._file, self._encoding, self._most, self._tell = file, encoding, most, tell
        self._untold = 0
        self._waiting: deque[bytes] = deque()
        self._size = 0  # of what waits or is being written [bytes]
        self._changed = threading.Condition()
        self._thread: threading.Thread | None = None
        self._gone = False  # whether nobody will ever read

    def write(self, text: str, /) -> int:
        """Write without waiting; all of a text or nothing of it."""
        if text:
            with self._changed:
                self._put(text)
        return len(text)

    def flush(self) -> None:
        """Nothing: it is on its way."""

    def drain(self, timeout: float = LAST_WORDS) -> bool:
        """Wait until all is written; returns whether it is, after so long at the most [s]."""
        with self._changed:
            return self._changed.wait_for(lambda: self._size == 0, timeout)

    def writable(self) -> bool:
        """As of a stream."""
        return True

    def isatty(self) -> bool:
        """Whether it is a terminal."""
        return os.isatty(self._file)

    def fileno(self) -> int:
        """Descriptor of the file."""
        return self._file

    @property
    def encoding(self) -> str:  # type: ignore[override]
        """Encoding of the text."""
        return self._encoding

    def _put(self, text: str) -> None:
        data = text.encode(self._encoding, "backslashreplace")
        if self._untold and not self._gone:
            data = self._tell(self._untold).encode(self._encoding, "backslashreplace") + data
        # A text that is longer than all that may wait goes alone.
        if self._gone or (self._size and self._size + len(data) > self._most):
            self._leave_out(text.count("\n"))
            return
        self._untold = 0
        self._waiting.append(data)
        self._size += len(data)
        if self._thread is None:
            self._thread = threading.Thread(target=self._run, name="aside", daemon=True)
            self._thread.start()
        self._changed.notify_all()

    def _run(self) -> None:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._waiting)
                data = self._waiting.popleft()
            # Not the stream: at the end of the program Python would wait for its lock.
            error = self._write(data)
            with self._changed:
                self._size -= len(data)
                if error is not None:
                    self._leave_out(data.count(b"\n"))
                    if self._is_end(error):
                        self._gone, self._size = True, 0
                        self._waiting.clear()
                self._changed.notify_all()

    def _write(self, data: bytes) -> OSError | None:
        left = memoryview(data)
        while left:
            try:
                left = left[os.write(self._file, left) :]
            except BlockingIOError:  # somebody has made the file so
                _wait_writable(self._file)
            except OSError as error:
                return error
        return None

    def _is_end(self, error: OSError) -> bool:
        """Whether it has no reader any more; a disk that is full may have room again."""
        if error.errno == errno.EIO:
            return os.isatty(self._file)
        return error.errno in (errno.EPIPE, errno.EBADF)

    def _leave_out(self, lines: int) -> None:
        self.left_out += max(1, lines)
        self._untold += max(1, lines)


def _wait_writable(file: int) -> None:
    import select

    select.select([], [file], [])
