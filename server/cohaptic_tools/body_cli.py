"""Commands `cohaptic body prepare` and `cohaptic body inspect`, for an object from a file."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from cohaptic.cli.app import ChapterCommand
from cohaptic.cli.output import Overwrite
from cohaptic_server.cli.object_options import ObjectOptions, Users, takes_object

body = typer.Typer(help="Prepare an object from a file, or inspect it.", no_args_is_help=True)


File = Annotated[Path, typer.Argument(help="The mesh, as `cohaptic serve --body` takes it.")]


@body.command(cls=ChapterCommand)
@takes_object
def prepare(
    file: File,
    *,
    options: ObjectOptions,
    users: Users = None,
    hz: Annotated[
        float, typer.Option(help="Rate of the simulation for them, 10 to 200 [Hz].")
    ] = 60.0,
) -> None:
    """Mesh and factorise an object, so that `serve` starts soon.

    The result is found again by a hash of the file and the options. It is kept in the cache of this
    system or the folder COHAPTIC_CACHE, up to COHAPTIC_CACHE_GB (20). Machines may share it by
    COHAPTIC_SHARED_CACHE, a URL such as s3://bucket/folder.
    """
    from cohaptic_tools.inspection.object_files import prepare_object

    prepare_object(file, options, users, hz)


@body.command(cls=ChapterCommand)
@takes_object
def inspect(
    file: File,
    *,
    options: ObjectOptions,
    users: Users = None,
    hz: Annotated[
        float, typer.Option(help="Rate of the simulation for them, 10 to 200 [Hz].")
    ] = 60.0,
    out: Annotated[
        Path | None, typer.Option(help="Draw the stiffness over the surface to this PNG.")
    ] = None,
    overwrite: Overwrite = False,
) -> None:
    """Say what a file became: mesh, mass, stiffness, cost, repairs."""
    from cohaptic_tools.inspection.object_files import show_object

    show_object(file, options, users, hz, out, overwrite=overwrite)
