"""Prepares an object from a file, or prints its properties."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table
from rich.text import Text

from cohaptic.cli.output import new_output
from cohaptic.clock import SystemClock
from cohaptic.errors import one_line
from cohaptic_server.cli.object_options import ObjectOptions
from cohaptic_server.cli.progress_bar import progress_bar
from cohaptic_server.cli.resolved_object import resolved, wanted
from cohaptic_server.objects.build import build
from cohaptic_server.objects.fix_surface import FixSurface, axes_of_object
from cohaptic_server.objects.object_file import ObjectFile
from cohaptic_server.objects.prepare import check_file
from cohaptic_server.objects.scan.label_map import LabelMap
from cohaptic_server.objects.scan.read import is_scan, read_scan
from cohaptic_server.objects.store.cache import cache_folder, insisting
from cohaptic_server.process_memory import peak_memory
from cohaptic_tools.inspection.inspection import Inspection, inspect_object, part_words
from cohaptic_tools.inspection.picture import draw
from cohaptic_tools.inspection.sections import draw_sections


def prepare_object(file: Path, options: ObjectOptions, users: int | None, hz: float) -> None:
    """Prepare and store an object, and print the time and memory that this took.

    Args:
        file: Path of the mesh.
        options: Options as the user has written them.
        users: Number of users for whom the mesh is chosen; None if the option is missing.
        hz: Ticks per second with these users.

    Raises:
        CohapticError: An option is out of its range, the file contains no object that can be
            touched, or the object cannot be stored.
    """
    clock = SystemClock()
    start = clock.now()
    with insisting(), progress_bar(f"preparing {file.name}") as progress:
        source = resolved(file, options, progress, print, wanted(users, hz))
        built = build(source, progress)
    solid, peak = built.solid, peak_memory()
    memory = f", {peak / 1e9:.2f} GB of memory at the most"
    if built.cost is not None:
        memory += f" ({built.cost.memory / 1e9:.2f} expected)"
    print(
        f"{_shown(file)}: {len(solid.shape.tets.tets):,} tetrahedra,"
        f" {len(solid.mesh.vertices):,} vertices of surface, {solid.factor_bytes / 1e6:,.0f} MB;"
        f" ready in {cache_folder()} after"
        f" {clock.now() - start:.1f} s{memory}"
    )


def show_object(
    file: Path,
    options: ObjectOptions,
    users: int | None,
    hz: float,
    out: Path | None,
    *,
    overwrite: bool,
) -> None:
    """Print the properties of the object in a file, and draw it.

    Args:
        file: Path of the mesh or scan.
        options: Options as the user has written them.
        users: Number of users for whom the duration of a tick is judged; None if the option is
            missing.
        hz: Ticks per second with these users.
        out: Path of the picture; None for no picture.
        overwrite: Whether the pictures may replace files.

    Raises:
        CohapticError: An option is out of its range, or the file contains no object that can be
            touched.
    """
    for picture in () if out is None else (out, _sections_of(out)):
        new_output("--out", picture, ".png", overwrite=overwrite)
    if is_scan(file) and "label" not in options.given and not options.auto:
        check_file(file)
        labels = read_scan(file)
        if len(labels.labels) > 1:
            _list_labels(file, labels)
            return
    written: list[Path] = []
    with progress_bar(f"inspecting {file.name}") as progress:
        source = resolved(file, options, progress, print, wanted(users, hz))
        built = build(source, progress)
        inspection = inspect_object(
            source,
            built,
            SystemClock(),
            progress,
            wanted(users, hz),
        )
        if out is not None:
            progress("picture", 0.0)
            written = _draw(out, source, inspection, overwrite=overwrite)
    table = Table(box=None, pad_edge=False, show_header=False)
    table.add_column(style="dim")
    for heading, sentence in inspection.lines(source):
        table.add_row(heading, Text(sentence))
    console = Console(highlight=False)
    console.print(table)
    for picture in written:
        console.print(f"written to {_shown(picture)}", markup=False)


def _sections_of(out: Path) -> Path:
    """Return the path of the second picture, of an object with parts."""
    return out.with_name(f"{out.stem}-parts{out.suffix}")


def _shown(path: Path) -> str:
    """Return a path as one printable line: its name may hold anything."""
    return one_line(str(path), 1000)


def _list_labels(file: Path, labels: LabelMap) -> None:
    """Print a table of the labels of a scan, and the options that choose among them."""
    table = Table("label", "name", "cm3", "box [mm]", box=None, pad_edge=False, header_style="dim")
    for label in labels.labels:
        name = "" if label.name == str(label.value) else label.name
        box = " x ".join(f"{1e3 * side:.0f}" for side in labels.size(label).tolist())
        volume = 1e6 * labels.voxel * label.voxels
        table.add_row(str(label.value), Text(name), f"{volume:.3g}", box)
    console = Console(highlight=False)
    spacing = " x ".join(f"{1e3 * side:.3g}" for side in labels.spacing.tolist())
    shape = " x ".join(str(n) for n in labels.numbers.shape)
    console.print(f"{_shown(file)}: {shape} voxels of {spacing} mm", markup=False)
    console.print(table)
    example = f"--label {labels.labels[0].value}=organ --young organ=5e3"
    console.print(
        f"Choose the object with --label, once for each that is a part: {example}", markup=False
    )


def _draw(out: Path, source: ObjectFile, inspection: Inspection, *, overwrite: bool) -> list[Path]:
    """Draw the stiffness and, if there are parts, sections through them; return the paths."""
    fixed = ~np.isfinite(inspection.stiffness)
    m = source.material
    notes = "" if inspection.parts else f"E {m.young:g} Pa, \N{GREEK SMALL LETTER NU} {m.nu:g}; "
    notes += (
        "contact of"
        f" {1e3 * inspection.solid.contact_radius:.1f} mm; held: {source.fix or source.fix_mesh}"
    )
    mesh, name = inspection.solid.mesh, one_line(source.path.name)
    axes, surface = axes_of_object(source.path), None
    if source.fix_mesh is not None:
        surface = FixSurface.of(source)
    holding = None if surface is None else (surface.placed() - mesh.origin, surface.faces)
    draw(
        out, mesh, inspection.stiffness, fixed, title=name, notes=notes, holding=holding,
        axes_of_file=axes, overwrite=overwrite,
    )  # fmt: skip
    if inspection.parts is None:
        return [out]
    sections = _sections_of(out)
    words = part_words(source, inspection.parts)
    tets = inspection.solid.shape.tets
    tets = replace(tets, vertices=tets.vertices + tets.origin)  # axes as in the file
    draw_sections(
        sections, tets, inspection.parts, words, title=name, axes_of_file=axes, overwrite=overwrite
    )
    return [out, sections]
