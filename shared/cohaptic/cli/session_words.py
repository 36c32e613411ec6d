"""What commands say of a session file: which one they take, and what it holds."""

from __future__ import annotations

from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from cohaptic.errors import one_line

if TYPE_CHECKING:
    from cohaptic.sessions.reader import Outline

_LISTED = 5  # marks, and users; more of them are counted only
_LONGEST = 60  # characters of a name or mark
# Entries by the name of their class, in words; what the outline says elsewhere is left out.
_KINDS = {
    "Ticked": "ticks",
    "Heard": "samples of hands",
    "Patched": "patches",
    "Shown": "scenes",
    "Rows": "blocks of rows of loops",
    "Link": "states of links",
    "Joined": "joins",
    "Left": "leaves",
    "LawSet": "changes of a law",
    "Happened": "events",
    "Mark": "marks",
}


def chosen_session(path: Path) -> Path:
    """Return the session file that a command takes; of a folder the only one in it, which is told.

    Raises:
        SettingError: The folder has none, or several.
    """
    from cohaptic.sessions.tables import session_file

    file = session_file(path)
    if file != path:
        typer.echo(f"cohaptic: the session is {file}", err=True)
    return file


def session_lines(path: Path) -> list[str]:
    """Return what a session file holds, as lines for a person.

    Raises:
        SettingError: The file cannot be read, or holds no session.
    """
    from cohaptic.sessions.reader import Outline

    outline = Outline.of(path)
    to_wall = outline.info.to_wall
    kinds = [f"{outline.counts[k]} {words}" for k, words in _KINDS.items() if outline.counts.get(k)]
    return [
        f"{path.name}: {outline.seconds:.1f} s of {_people(outline)}",
        f"from {local(outline.first + to_wall)} to {local(outline.last + to_wall)}",
        f"on the server's clock from {outline.first:.3f} to {outline.last:.3f} s",
        f"it has {', '.join(kinds) or 'no entries'}",
        *_marks(outline),
        *_missing(outline),
    ]


def _people(outline: Outline) -> str:
    users = list(outline.users.items())
    named = [f"{one_line(name, _LONGEST)} (user {user})" for user, name in users[:_LISTED]]
    if len(users) > _LISTED:
        named.append(f"{len(users) - _LISTED} more")
    room = one_line(outline.info.room, _LONGEST)
    return (", ".join(named) or "nobody") + (f", in the room {room}" if room else "")


def _marks(outline: Outline) -> list[str]:
    found = [
        f"mark at {mark.t:.3f} s, {mark.t - outline.first:.3f} s after the start:"
        f" {one_line(mark.text, _LONGEST)}"
        for mark in outline.marks[:_LISTED]
    ]
    if len(outline.marks) > _LISTED:
        found.append(f"and {len(outline.marks) - _LISTED} marks more")
    return found


def _missing(outline: Outline) -> list[str]:
    """Return what is not in the file; one line that says so where nothing is known to be missing.

    Damaged chunks are counted among the few that an outline reads.
    """
    found = [
        f"{count} rows of {one_line(outline.users.get(user, f'user {user}'), _LONGEST)} are missing"
        for user, count in sorted(outline.rows_lost.items())
    ]
    if outline.left_out:
        found.append(f"{outline.left_out} entries are missing, for which the disk was too slow")
    if outline.damaged:
        found.append("a part of it is damaged and cannot be read")
    if not outline.complete:
        found.append("it was cut short, as by a killed process: what came after that is missing")
    return found or ["nothing is known to be missing"]


def local(unix: float) -> str:
    """Return a Unix time [s] as a person reads it, with the offset of the time zone."""
    try:
        return datetime.fromtimestamp(unix).astimezone().isoformat(" ", "milliseconds")
    except (ValueError, OverflowError, OSError):
        return "an unknown time"
