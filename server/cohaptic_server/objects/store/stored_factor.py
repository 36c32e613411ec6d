"""A factor in the store, by its path: whoever solves with it maps it, and nobody else needs it."""

from __future__ import annotations

import contextlib
import os
from io import BufferedReader
from pathlib import Path

from cohaptic.errors import BodyError
from cohaptic_server.cholesky.factor import Factor
from cohaptic_server.cholesky.factor_file import from_arrays
from cohaptic_server.objects.store.array_file import read_arrays

PREFIX = "factor/"  # of its arrays in an entry


class StoredFactor:
    """A factor that is read when it is needed, in the process that needs it.

    Args:
        path: Of its entry.
        count: Memory of its numbers [bytes].

    Attributes:
        bytes: As `count`.
    """

    def __init__(self, path: Path, count: int) -> None:
        self.path, self.bytes = path, count
        self._file: BufferedReader | None = None
        self._seen: tuple[int, int] | None = None

    def read(self) -> Factor:
        """The factor, mapped from its file. A damaged entry is deleted, so that it is made anew.

        Raises:
            BodyError: It is damaged.
            OSError: It cannot be read.
        """
        # Left open: the entry may be deleted from the folder while it is mapped.
        self._file = self.path.open("rb")
        self._seen = _state(self._file)
        try:
            return from_arrays(read_arrays(self._file, self.path, under=PREFIX))
        except (BodyError, ValueError, KeyError, TypeError) as error:
            with contextlib.suppress(OSError):
                self.path.unlink()
            raise BodyError(f"the stored factor is damaged, and was deleted ({error})") from error

    def problem(self) -> str:
        """Why the factor is not to be relied on any more: its file has been written to."""
        if self._file is None or _state(self._file) == self._seen:
            return ""
        return f"the stored factor was changed while it is in use ({self.path})"


def _state(file: BufferedReader) -> tuple[int, int]:
    """Size and time of the last change."""
    found = os.fstat(file.fileno())
    return found.st_size, found.st_mtime_ns
