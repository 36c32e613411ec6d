"""The sentence about a file that a library could not read, whatever its reader has raised."""

from __future__ import annotations

import struct
from pathlib import Path

from cohaptic.errors import BodyError, one_line

# Their text names what a program did, such as "list index out of range", or is empty: it says
# nothing to whoever has the file. Texts of all others were written to be read.
_OF_PROGRAMS = (
    ArithmeticError, AssertionError, AttributeError, LookupError, NameError,
    RecursionError, StopIteration, TypeError, UnicodeError, struct.error,
)  # fmt: skip


def unreadable(path: Path, kind: str, error: Exception) -> BodyError:
    """The error about a file that is not read.

    Args:
        path: The file.
        kind: What it should have been, such as `mesh`.
        error: That its reader has raised.
    """
    return BodyError(f"{path}: this is no {kind} that can be read: {damaged(error)}")


def damaged(error: BaseException) -> str:
    """Why a reader gave up, as far as that can be said; part of a sentence.

    Args:
        error: That it has raised.
    """
    said = "" if isinstance(error, (*_OF_PROGRAMS, SystemExit)) else one_line(str(error)).strip()
    why = "it is damaged, locked, or of another kind than its name says"
    return f"{why} ({said})" if said else why
