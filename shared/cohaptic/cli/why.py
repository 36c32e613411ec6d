"""Command `cohaptic why`: what each rule did to a force, from a recording."""

from __future__ import annotations

import json
import math
import textwrap
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cohaptic.cli.output import Overwrite, new_output
from cohaptic.cli.session_words import chosen_session
from cohaptic.errors import SettingError, one_line

if TYPE_CHECKING:
    from cohaptic.recording.archive import Recording
    from cohaptic.recording.why import Columns, Floats, Why

_SEEN = 0.0005  # N; a smaller entry is left out of the table
_TAKEN = 0.0002  # N of a budget; the same
_MARKS = 24  # characters of the longest bar


# Above 60 lines: every option of the command is a parameter.
def why(
    recording: Annotated[
        Path,
        typer.Argument(
            help="A recording, or with --user a session or a folder of recordings or one session."
        ),
    ],
    at: Annotated[
        float | None,
        typer.Option(
            "--at",
            help="Seconds since its beginning, in a session since the user's first row. A number"
            " above the session's length is a time `t` of its tables, on the server's clock.",
        ),
    ] = None,
    user: Annotated[
        str | None, typer.Option(help="Whose recording in a session or folder.")
    ] = None,
    start: Annotated[
        float | None, typer.Option("--from", help="With --out: the first second.")
    ] = None,
    end: Annotated[float | None, typer.Option("--to", help="With --out: the last.")] = None,
    out: Annotated[
        Path | None, typer.Option("--out", help="Draw the stack of forces over time (.png).")
    ] = None,
    json_to: Annotated[
        Path | None, typer.Option("--json", help="Write the answer to this file; - prints it.")
    ] = None,
    overwrite: Overwrite = False,
) -> None:
    """Say why a force was as it was, rule by rule.

    `cohaptic touch --record` and `serve --record` keep the ledger of each millisecond. The entries
    add up to the force that the hand was given; the budget is what others may change of it in that
    time.
    """
    from cohaptic.recording.why import check_ledger
    from cohaptic.recording.why import why as explain

    if at is None and out is None:
        raise SettingError("--at", "missing", "the second to explain (or --out, to draw them all)")
    if at is None and json_to is not None:
        raise SettingError("--json", json_to, "given with --at: it has the answer for one moment")
    if out is None and (start is not None or end is not None):
        raise SettingError("--from, --to", "given", "left out, or given with --out")
    picture = new_output("--out", out, ".png", overwrite=overwrite)
    as_json = None if str(json_to) == "-" else json_to
    answers = new_output("--json", as_json, overwrite=overwrite)
    if (file := _session_in(recording)) is not None:
        path, rules = file, dict[str, str]()
        name, columns, at = _of_session(file, user, at)
    else:
        path, found = _chosen(recording, user)
        header = found.outline.header
        name, rules = header.name, dict(header.rules)
        columns = dict(zip(header.columns, found.rows.T, strict=True))
    check_ledger(path, columns)
    if at is not None:
        answer = explain(columns, at, rules)
        text = json.dumps(asdict(answer), indent=2)
        if answers is not None:
            answers.write(text + "\n")
        if str(json_to) == "-":
            typer.echo(text)
        else:
            typer.echo("\n".join(lines(one_line(name), answer)))
    if picture is not None:
        from cohaptic.cli.why_picture import draw

        length = float(columns["t"][-1] - columns["t"][0])
        draw(picture, columns, start or 0.0, length if end is None else end)
        typer.echo(f"drawn to {picture.path}")


def lines(name: str, answer: Why) -> list[str]:
    """Return an answer as lines for a person, 80 characters wide."""
    found = [f"{name}, {answer.t:.3f} s after the beginning:", ""]
    shown = [entry for entry in answer.entries if abs(entry.newtons) > _SEEN]
    largest = max([answer.force, *(abs(entry.newtons) for entry in shown), 1e-9])
    width = max([9, *(len(entry.name) for entry in shown)])
    for entry in shown:
        bar = "-" if entry.newtons < 0.0 else "+"
        marks = bar * max(1, round(_MARKS * abs(entry.newtons) / largest))
        found.append(f"  {entry.name:{width}} {entry.newtons:+7.3f} N  {marks}")
        found += [f"    {line}" for line in textwrap.wrap(entry.words, 76)]
    found.append(f"  {'given':{width}} {answer.force:7.3f} N")
    if answer.budget > 0.0:
        takers = [f"{name} {spent:.4f}" for name, spent in answer.spent.items() if spent > _TAKEN]
        taken = ", ".join(takers) or "nobody took any"
        found.append(f"  {'budget':{width}} {answer.budget:7.4f} N: {taken}")
    return [*found, "", *textwrap.wrap(answer.sentence, 80)]


def _session_in(path: Path) -> Path | None:
    """Return the session file at a path or in a folder without recordings; None for neither.

    Raises:
        SettingError: The folder has several.
    """
    if path.is_dir():
        only = any(path.glob("*.mcap")) and not any(path.glob("*.npz"))
        return chosen_session(path) if only else None
    return path if path.suffix == ".mcap" else None


def _of_session(
    path: Path, user: str | None, at: float | None
) -> tuple[str, Columns, float | None]:
    """Return the rows of one user of a session file, from its first row on.

    Returns:
        The user's name, the columns, and the time `at` as time since the first row [s].

    Raises:
        SettingError: There are none of that user or, on the server's clock, of that time; or the
            file cannot be read.
    """
    import numpy as np

    from cohaptic.sessions.codec import table_of
    from cohaptic.sessions.entries import Rows
    from cohaptic.sessions.reader import Outline, read_entries

    outline = Outline.of(path)
    people = outline.users
    blocks = dict[int, list[Rows]]()
    for entry in read_entries(path, only=(Rows,)):
        if isinstance(entry, Rows) and user in (None, people.get(entry.user)):
            blocks.setdefault(entry.user, []).append(entry)
    if len(blocks) != 1:  # of several visits of one name, too
        names = ", ".join(sorted(set(people.values()))) or "nobody is in that session"
        limit = f"one of: {names}; with rows of the loop, and there for one visit"
        raise SettingError("--user", user or "missing", limit)
    ((number, found),) = blocks.items()
    table = np.concatenate([table_of(rows) for rows in found])
    if at is not None and at > outline.seconds and len(table):
        # As the tables have it: between two blocks the offset of the clocks is interpolated.
        known = [rows for rows in found if rows.block and math.isfinite(rows.to_server)]
        pairs = sorted((float(table_of(rows)[0, 0]), rows.to_server) for rows in known)
        begins, offsets = np.array(pairs or [(0.0, 0.0)], float).T
        own: Floats = np.asarray(table[:, 0], float)
        on_server: Floats = np.asarray(own + np.interp(own, begins, offsets), float)
        at = _since_first(on_server, own, at)
    return people.get(number, str(number)), dict(zip(found[0].columns, table.T, strict=True)), at


def _since_first(t: Floats, own: Floats, at: float) -> float:
    """Return a time of the server's clock as the time since a user's first row [s].

    Args:
        t: Times of the rows on the server's clock, shape (n,) [s].
        own: The same on the client's clock.
        at: Time [s].

    Raises:
        SettingError: The user has no row of that time.
    """
    if not float(t[0]) <= at <= float(t[-1]):
        limit = f"from 0 to {own[-1] - own[0]:.3f} s after the first row of this user,"
        limit += f" or from {t[0]:.3f} to {t[-1]:.3f} s on the server's clock"
        raise SettingError("--at", f"{at:g} s", limit)
    return float(own[int(t.searchsorted(at, side="right")) - 1] - own[0])


def _chosen(path: Path, user: str | None) -> tuple[Path, Recording]:
    """Return the recording that was asked for.

    Raises:
        SettingError: There is none of that user, or it cannot be read.
    """
    from cohaptic.recording.archive import read_recording

    if not path.is_dir():
        found = read_recording(path)
        if user is not None and found.outline.header.name != user:
            raise SettingError(
                "--user", user, f"{found.outline.header.name}, whose recording it is"
            )
        return path, found
    files = sorted(path.glob("*.npz"))
    named = {file: read_recording(file).outline.header.name for file in files}
    matching = [file for file, name in named.items() if user is None or name == user]
    if len(matching) != 1:
        names = ", ".join(sorted(named.values())) or "nobody's recordings are in that folder"
        raise SettingError("--user", user or "missing", f"one of: {names}")
    return matching[0], read_recording(matching[0])
