"""Safe reading of a file through a library: a limit on memory, and one error for all failures.

A mesh file declares its counts, and readers allocate memory for them without a check: a .msh file
of 644 bytes made a reader ask for 4 GiB. Checks of headers cannot cover all formats; the limit of
the system covers them, where the system can set one.

Any error that the library raised becomes the error about an unreadable file.
"""

from __future__ import annotations

import contextlib
import io
import logging
import struct
import sys
import warnings
from collections.abc import Generator
from functools import lru_cache
from pathlib import Path

import numpy as np

from cohaptic.errors import BodyError, one_line

log = logging.getLogger("cohaptic.server")

# Reading text into Python's lists takes about 30 bytes of memory for each byte of the file.
_PER_BYTE = 64
_LEAST = 2**30  # bytes; libraries map some hundred megabytes when they are imported


@contextlib.contextmanager
def reading_limited(path: Path) -> Generator[None]:
    """Limit the memory that the code in the `with` block may take, by the size of the file.

    The limit exists on Linux only. A lower limit that the process already has stays in force.
    Warnings of numpy about numbers beyond their types are off, since the checks behind a reader
    say in words what is wrong with them.

    Raises:
        BodyError: Reading the file needs more memory than the limit allows.
    """
    allowed = _LEAST + _PER_BYTE * path.stat().st_size
    try:
        with _address_space(allowed), np.errstate(all="ignore"):
            yield
    except MemoryError as error:
        raise BodyError(
            f"{path}: reading it would take more than {allowed / 1e9:.2g} GB; the file has"
            f" {path.stat().st_size:,} bytes, and says or unpacks to far more"
        ) from error


@contextlib.contextmanager
def silenced(library: str) -> Generator[None]:
    """Let a library neither print, nor warn, nor log: our own words tell what becomes of a file.

    Args:
        library: Name of its logger, to which those of its modules pass what they log.
    """
    log_of, nowhere = logging.getLogger(library), io.StringIO()
    before = log_of.handlers, log_of.propagate
    # Modules of a library have loggers of their own, which ignore whether this one is disabled.
    log_of.handlers, log_of.propagate = [logging.NullHandler()], False
    try:
        with (
            warnings.catch_warnings(),
            contextlib.redirect_stdout(nowhere),
            contextlib.redirect_stderr(nowhere),
        ):
            warnings.simplefilter("ignore")
            yield
    finally:
        log_of.handlers, log_of.propagate = before


@contextlib.contextmanager
def named(path: Path) -> Generator[None]:
    """Let an error of checks that know no file begin with the path of the file."""
    try:
        yield
    except BodyError as error:
        raise BodyError(f"{path}: {error}") from error


@contextlib.contextmanager
def _address_space(more: int) -> Generator[None]:
    """Limit the address space of this process to its present size plus `more` bytes."""
    if sys.platform != "linux":
        yield
        return
    import resource

    before = resource.getrlimit(resource.RLIMIT_AS)
    limit = address_space() + more
    if before[0] != resource.RLIM_INFINITY and before[0] <= limit:
        yield
        return
    resource.setrlimit(resource.RLIMIT_AS, (limit, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_AS, before)


def address_space() -> int:
    """Size of the address space that this process uses now [bytes]; Linux only."""
    import resource

    pages = int(Path("/proc/self/statm").read_text().split()[0])
    return pages * resource.getpagesize()


@lru_cache(maxsize=64)
def say_once(path: Path, words: str) -> None:
    """Log how a file was read otherwise than it is written; only once, though it is read again."""
    log.warning("%s: %s", one_line(str(path), 1000), words)


# The texts of these errors describe the program, such as "list index out of range", or are empty:
# they do not help the user. The texts of all other errors were written for users.
_OF_PROGRAMS = (
    ArithmeticError, AssertionError, AttributeError, LookupError, NameError,
    RecursionError, StopIteration, TypeError, UnicodeError, struct.error,
)  # fmt: skip


def unreadable(path: Path, kind: str, error: Exception) -> BodyError:
    """Make the error about a file that cannot be read.

    Args:
        kind: Expected kind of file, such as `mesh`.
        error: Error that the reader of the file raised.
    """
    return BodyError(f"{path}: this is no {kind} that can be read: {damaged(error)}")


def damaged(error: BaseException) -> str:
    """Words on why a reader failed, with the text of its error if that can help the user.

    Args:
        error: Error that the reader raised.
    """
    said = "" if isinstance(error, (*_OF_PROGRAMS, SystemExit)) else one_line(str(error)).strip()
    why = "it is damaged, locked, or of another kind than its name says"
    return f"{why} ({said})" if said else why
