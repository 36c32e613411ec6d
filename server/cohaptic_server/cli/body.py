"""`cohaptic body`: prepare an object from a file, or inspect it."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from cohaptic_server.cli.object_options import ObjectOptions, Users, takes_object

body = typer.Typer(
    help="Prepare an object from a file, or look at what it became.", no_args_is_help=True
)


File = Annotated[Path, typer.Argument(help="The mesh, as `cohaptic serve --body` takes it.")]


@body.command()
@takes_object
def prepare(
    file: File,
    *,
    options: ObjectOptions,
    users: Users = None,
    hz: Annotated[float, typer.Option(help="Ticks per second for them, 10 to 200.")] = 60.0,
) -> None:
    """Do the long part once; `cohaptic serve --body FILE` with the same options then starts soon.

    It is kept under the content of the file and of the options, in the cache of this system or
    the folder COHAPTIC_CACHE, up to COHAPTIC_CACHE_GB (20).
    """
    from cohaptic_server.cli.work.object_files import prepare_object

    prepare_object(file, options, users, hz)


@body.command()
@takes_object
def inspect(
    file: File,
    *,
    options: ObjectOptions,
    users: Users = None,
    hz: Annotated[float, typer.Option(help="Ticks per second for them, 10 to 200.")] = 60.0,
    out: Annotated[
        Path | None, typer.Option(help="Draw how stiff it is where to this PNG.")
    ] = None,
) -> None:
    """Say what a file became: mesh, mass, stiffness, what it costs, what was repaired."""
    from cohaptic_server.cli.work.object_files import show_object

    show_object(file, options, users, hz, out)
