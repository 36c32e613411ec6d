"""Command `cohaptic recording`: says what a file holds, and finishes that of a killed process."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cohaptic.cli.output import Overwrite, new_output
from cohaptic.cli.session_words import chosen_session, local, session_lines
from cohaptic.errors import SettingError

if TYPE_CHECKING:
    from cohaptic.recording.outline import Outline

_LISTED = 5  # gaps; more of them are counted only
# Change of `to_wall` [s] that tells of a wall clock that was set: clocks drift by less in an hour.
_SET = 0.2


def recording(
    file: Annotated[
        Path, typer.Argument(help="A session (.mcap), a folder with one, or a .npz or its .part.")
    ],
    finish: Annotated[
        bool,
        typer.Option(
            "--finish", help="Turn the .part that a killed program has left into a .npz beside it."
        ),
    ] = False,
    overwrite: Overwrite = False,
) -> None:
    """Say what a recording holds, or finish one of a killed program.

    That is whose it is, when it was made, how long it is, and what it lacks. While
    `cohaptic touch --record NAME.npz` runs, the rows are in NAME.npz.part, which may be read too. A
    session needs no --finish: that of a killed process is read as far as it reaches.
    """
    if file.is_dir() or file.suffix == ".mcap":
        if finish:
            raise SettingError("--finish", file, "given for a .part; a session is read as it is")
        path = chosen_session(file)
        for line in session_lines(path):
            typer.echo(line)
        return
    from cohaptic.recording.archive import finish as turn
    from cohaptic.recording.archive import name_of, read_outline
    from cohaptic.recording.part import Part

    if not finish:
        for line in lines(read_outline(file)):
            typer.echo(line)
        return
    name = name_of(file)
    new_output("recording", name, ".npz", overwrite=overwrite)
    for line in lines(turn(Part.left(file), name, overwrite=overwrite)):
        typer.echo(line)
    typer.echo(f"written to {name}")
    if file.exists():
        typer.echo(f"{file} stays: a part of it is damaged and could not be read")


def lines(outline: Outline) -> list[str]:
    """Return what is known of a recording, as lines for a person."""
    from cohaptic.recording.archive import in_words

    found = [in_words(outline)]
    known = [clocks for clocks in outline.clocks if not math.isnan(clocks.to_wall)]
    if known and outline.count:
        began = local(outline.first + known[0].to_wall)
        found.append(f"from {began} to {local(outline.last + known[-1].to_wall)}")
        moved = known[-1].to_wall - known[0].to_wall
        if abs(moved) > _SET:
            found.append(f"the wall clock was set by {moved:+.1f} s meanwhile")
    errors = [clocks.error for clocks in outline.clocks if not math.isnan(clocks.error)]
    if errors:
        found.append(f"the server's clock is known within {1e3 * max(errors):.1f} ms")
    for gap in outline.gaps[:_LISTED]:
        found.append(
            f"gap of {gap.end - gap.start:.3f} s, {gap.start - outline.first:.3f} s after the start"
        )
    if len(outline.gaps) > _LISTED:
        found.append(f"and {len(outline.gaps) - _LISTED} gaps more")
    for damage in outline.damage:
        where = " at its end" if damage.cut_short else ""
        found.append(f"{damage.size} bytes{where} are no whole block, and were left out")
    return found
