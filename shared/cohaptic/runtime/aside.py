"""Write text to a terminal or a pipe in a separate thread, so that the program never waits.

A stopped terminal (Ctrl-S, a paused pane) or a full pipe blocks a write until its reader goes on.
The amount of waiting text is bounded. The stream leaves out and counts lines that do not fit, and
the next text that fits begins with the number of those lines.
"""

from __future__ import annotations

import errno
import io
import os
import threading
from collections import deque
from collections.abc import Callable
from typing import TextIO

LARGEST = 256 * 1024  # bytes that may wait to be written
LAST_WORDS = 1.0  # s; longest time that an ending program waits for its reader


def in_words(lines: int) -> str:
    """Return the line that tells a reader how many lines the stream has left out."""
    return f"{lines} lines were left out here: nobody read them in time\n"


def aside(
    stream: TextIO, limit: int = LARGEST, tell: Callable[[int], str] = in_words
) -> Aside | TextIO:
    """Return a stream that writes to the same file as `stream` without ever waiting.

    The function returns `stream` itself if that has no open file descriptor.

    Args:
        stream: Stream of a terminal, a pipe or a file.
        limit: Largest amount of text that may wait to be written [bytes].
        tell: Function that makes the message for a reader from the number of lines left out.
    """
    try:
        stream.flush()
        return Aside(stream.fileno(), stream.encoding or "utf-8", limit, tell)
    except (OSError, ValueError, AttributeError):  # in a test, or the stream is closed
        return stream


class Aside(io.TextIOBase):
    """Text stream that writes to one file in a separate thread, so that writing never waits.

    Args:
        file: Descriptor of the file, which this class does not close.
        limit: Largest amount of text that may wait to be written [bytes].
        tell: As for `aside`.

    Attributes:
        left_out: Number of lines left out so far.
    """

    def __init__(
        self,
        file: int,
        encoding: str = "utf-8",
        limit: int = LARGEST,
        tell: Callable[[int], str] = in_words,
    ) -> None:
        self.left_out = 0
        self._file, self._encoding, self._limit, self._tell = file, encoding, limit, tell
        self._untold = 0
        self._waiting: deque[bytes] = deque()
        self._size = 0  # text that waits or is being written [bytes]
        self._changed = threading.Condition()
        self._thread: threading.Thread | None = None
        self._gone = False  # whether the file will have no reader any more

    def write(self, text: str, /) -> int:
        """Accept a text without waiting; the thread writes all of it or leaves out all of it."""
        if text:
            with self._changed:
                self._put(text)
        return len(text)

    def flush(self) -> None:
        """Do nothing: the thread is writing already."""

    def drain(self, timeout: float = LAST_WORDS) -> bool:
        """Wait at most `timeout` [s] for the thread; return whether it has written all text."""
        with self._changed:
            return self._changed.wait_for(lambda: self._size == 0, timeout)

    def writable(self) -> bool:
        """Return True: the stream accepts text."""
        return True

    def isatty(self) -> bool:
        """Return whether the file is a terminal."""
        return os.isatty(self._file)

    def fileno(self) -> int:
        """Return the descriptor of the file."""
        return self._file

    @property
    def encoding(self) -> str:  # type: ignore[override]
        """Encoding of the text."""
        return self._encoding

    def _put(self, text: str) -> None:
        data = text.encode(self._encoding, "backslashreplace")
        if self._untold and not self._gone:
            data = self._tell(self._untold).encode(self._encoding, "backslashreplace") + data
        # A text longer than the bound is accepted if nothing else waits.
        if self._gone or (self._size and self._size + len(data) > self._limit):
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
            # Write to the descriptor: Python would wait for a stream's lock when the program ends.
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
            except BlockingIOError:  # another process has made the file non-blocking
                _wait_writable(self._file)
            except OSError as error:
                return error
        return None

    def _is_end(self, error: OSError) -> bool:
        """Return whether an error means that the file will have no reader any more.

        A full disk is no such error, since it may have room again.
        """
        if error.errno == errno.EIO:
            return os.isatty(self._file)
        return error.errno in (errno.EPIPE, errno.EBADF)

    def _leave_out(self, lines: int) -> None:
        self.left_out += max(1, lines)
        self._untold += max(1, lines)


def _wait_writable(file: int) -> None:
    import select

    select.select([], [file], [])
