"""`cohaptic body`: prepare an object from a file, and look at it."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from cohaptic.clock import SystemClock
from cohaptic_server.bodies.solid_shape import SolidSettings
from cohaptic_server.objects.build import build
from cohaptic_server.objects.cache import folder
from cohaptic_server.objects.object_file import ObjectFile
from cohaptic_server.progress_bar import progress_bar
from cohaptic_server.solid_options import (
    SOLID,
    ContactRadius,
    Edge,
    Fix,
    FixMesh,
    Order,
    Poisson,
    Repair,
    Scale,
    Simplify,
    Young,
)

body = typer.Typer(
    help="Prepare an object from a file, or look at what it became.", no_args_is_help=True
)

File = Annotated[Path, typer.Argument(help="The mesh, as `cohaptic serve --body` takes it.")]


@body.command()
def prepare(
    file: File,
    young: Young = SOLID.young,
    poisson: Poisson = SOLID.nu,
    fix: Fix = "",
    fix_mesh: FixMesh = None,
    scale: Scale = 1.0,
    edge: Edge = 0.05,
    order: Order = SOLID.order,
    contact_radius: ContactRadius = 0.0,
    repair: Repair = False,
    simplify: Simplify = 0,
) -> None:
    """Do the long part once; `cohaptic serve --body FILE` with the same options then starts soon.

    It is kept under the content of the file and of the options, in the cache of this system or
    the folder COHAPTIC_CACHE, up to COHAPTIC_CACHE_GB (20).
    """
    material = SolidSettings(young, poisson, contact_radius, order)
    wanted = ObjectFile(file, fix, scale, edge, repair, material, fix_mesh, simplify)
    clock = SystemClock()
    begun = clock.now()
    with progress_bar(f"preparing {file.name}") as progress:
        solid = build(wanted, progress).solid
    print(
        f"{file}: {len(solid.tets.tets):,} tetrahedra, {len(solid.mesh.vertices):,} vertices of"
        f" surface, {solid.factor_bytes / 1e6:,.0f} MB; ready in {folder()} after"
        f" {clock.now() - begun:.1f} s"
    )
