"""Makes the error about an unreadable file from any error that the library reading it raised."""

from __future__ import annotations

import struct
from pathlib import Path

from cohaptic.errors import BodyError, one_line

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
