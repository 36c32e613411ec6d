"""Turns a mesh file into checked tetrahedra: reads it, checks it and fills its surface."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from cohaptic.errors import BodyError
from cohaptic_server.mesh.tetrahedra import SeveralPiecesError, TetMesh, volumes
from cohaptic_server.numeric import Floats, Ints
from cohaptic_server.objects.cost import about, filling_seconds, tetrahedra_expected
from cohaptic_server.objects.fill_process import FillLimitError
from cohaptic_server.objects.first_bytes import START, check_link, check_start
from cohaptic_server.objects.memory_limit import named
from cohaptic_server.objects.object_file import MAX_TRIANGLES, ObjectFile
from cohaptic_server.objects.parts.nodes import (
    check_volumes,
    innermost,
    members,
    read_surfaces,
    sizes,
)
from cohaptic_server.objects.parts.parts import Parts, PartSurface, VolumeLostError, joined
from cohaptic_server.objects.parts.surfaces import examine_all, simplified_to
from cohaptic_server.objects.scan.read import is_scan
from cohaptic_server.objects.scan.scan_surfaces import FEWER, ScanSurfaces, scan_surfaces
from cohaptic_server.objects.surface.accept import (
    check_count,
    check_deviation,
    check_size,
    check_surface,
    check_volume,
    farthest,
)
from cohaptic_server.objects.surface.checks import SurfaceReport, examine, facing_outwards, is_flat
from cohaptic_server.objects.surface.shell import in_one_sense, thicken
from cohaptic_server.objects.surface.simplify import count_triangles
from cohaptic_server.objects.tetrahedralise import (
    FINEST,
    NothingFitsError,
    envelope,
    tetrahedralise,
)
from cohaptic_server.objects.volume_file import read_volume
from cohaptic_server.progress import Progress
from cohaptic_server.touchable import KINDS, VOLUMES, kind_of


@dataclass(frozen=True, eq=False)
class Prepared:
    """The tetrahedra of a file, and the report on its surface.

    Args:
        tets: Tetrahedra of the object [m].
        surface: Report on the surface; None for a volume mesh.
        triangles: Number of triangles before simplification; 0 for a volume mesh.
        simplified: Number of triangles after simplification; 0 if a surface was not simplified.
        deviation: Largest distance from the surface in the file to that of the tetrahedra [m].
        parts: Parts of the tetrahedra, with their names in the file; None if there are no parts.
        words: Phrases about the voxels of a label map: their size, and each change to them.
    """

    tets: TetMesh
    surface: SurfaceReport | None
    triangles: int = 0
    simplified: int = 0
    deviation: float = 0.0
    parts: Parts | None = None
    words: tuple[str, ...] = ()


def prepare(source: ObjectFile, progress: Progress = lambda phase, fraction: None) -> Prepared:
    """Read a file, check it and fill its surface with tetrahedra.

    Args:
        progress: Called with the phase and the share of it that is done.

    Raises:
        BodyError: The file does not hold an object that can be touched.
    """
    check_file(source.path)
    if source.path.suffix.lower() in VOLUMES:
        return _prepare_volume(source)
    if is_scan(source.path):
        return _prepare_scan(source, progress)
    return _prepare_surface(source, progress)


def _prepare_volume(source: ObjectFile) -> Prepared:
    path = source.path
    x, cells, parts = read_volume(path, largest=source.repair)
    check_size(path, x * source.scale, source.scale)
    source.parts.check(() if parts is None else parts.names)
    with named(path):
        return Prepared(TetMesh.checked(x * source.scale, cells), None, parts=parts)


def _prepare_surface(source: ObjectFile, progress: Progress) -> Prepared:
    path = source.path
    progress("reading and checking", 0.0)
    if not source.simplify:
        check_count(path, count_triangles(path))  # reading millions of triangles takes minutes
    surfaces = read_surfaces(path)
    x, faces = joined(surfaces)
    triangles, simplified = len(faces), 0
    check_size(path, x * source.scale, source.scale)
    source.parts.check([surface.name for surface in surfaces if surface.name])
    if source.shell:
        x, faces = thicken(x, in_one_sense(x, faces), source.shell / source.scale)
        surfaces = (PartSurface("", x, faces),)
    originals = surfaces
    # The report describes the surface in the file and not the simplified one: crossings that even
    # the slowest simplification adds are untangled by filling.
    with named(path):
        report = examine_all(surfaces) if triangles <= MAX_TRIANGLES else None
    if source.simplify and len(faces) > source.simplify:
        progress("simplifying", 0.0)
        surfaces = _fewer(path, surfaces, source.simplify)
        x, faces = joined(surfaces)
        simplified = len(faces)
    check_count(path, len(faces))
    # A file with more triangles than the limit is examined only after simplification.
    culprit = "" if report else f"after --simplify {source.simplify}, which may have made this, "
    with named(path):
        report = report or examine_all(surfaces)
    check_surface(f"{path}: {culprit}", report, repair=source.repair)
    outwards = [one._replace(faces=facing_outwards(one.x, one.faces)) for one in surfaces]
    tets = _filled(source, outwards, report, progress)
    if len(outwards) == 1:  # parts, which may overlap, are checked one by one
        check_volume(source, tets, report)
    parts, deviation = _parts_of(source, originals, outwards, tets)
    return Prepared(tets, report, triangles, simplified, deviation, parts)


def _prepare_scan(source: ObjectFile, progress: Progress) -> Prepared:
    progress("reading and contouring", 0.0)
    scan = scan_surfaces(source.path, source.labels)
    originals = scan.surfaces
    check_size(source.path, originals[0].x * source.scale, source.scale)
    source.parts.check([surface.name for surface in originals if surface.name])
    progress("simplifying", 0.0)
    surfaces = _fewer(source.path, originals, source.simplify or FEWER)
    # The volume of the tetrahedra is later compared with that of the voxels.
    volume = float(scan.volumes.sum())
    with named(source.path):
        report = replace(examine(surfaces[0].x, surfaces[0].faces), volume=volume)
    check_surface(f"{source.path}: the surface of its labels: ", report, repair=source.repair)
    outwards = [one._replace(faces=facing_outwards(one.x, one.faces)) for one in surfaces]
    tets = _filled(source, outwards, report, progress, scan)
    check_volume(source, tets, report)
    count, fewer = (sum(len(one.faces) for one in some) for some in (originals, surfaces))
    scaled = [one._replace(x=source.scale * one.x) for one in outwards]
    deviation = farthest(source.scale * originals[0].x, tets.vertices, tets.tets)
    parts = None
    try:
        if len(scaled) > 1:
            parts = innermost(scaled, members(scaled, tets))
            if not source.repair:
                check_volumes(parts.names, parts.volumes(tets), scan.volumes * source.scale**3)
    except VolumeLostError as error:
        raise error.of(source.path) from error
    return Prepared(tets, report, count, fewer, deviation, parts, scan.words)


def _fewer(path: Path, surfaces: Sequence[PartSurface], count: int) -> tuple[PartSurface, ...]:
    """Surfaces with fewer triangles, of which each still encloses a volume.

    Triangles that lie on each other, as in a file that has its surface several times, let a
    simplification collapse all others.
    """
    with named(path):
        found = simplified_to(surfaces, count)
    flat = [one.name or "it" for one in found if is_flat(one.x, one.faces)]
    if flat:
        raise BodyError(
            f"{path}: {count:,} triangles leave nothing of {', '.join(flat)} that encloses a"
            " volume. Take more with --simplify, or delete what is there more than once"
        )
    return found


def _parts_of(
    source: ObjectFile,
    originals: Sequence[PartSurface],
    surfaces: Sequence[PartSurface],
    tets: TetMesh,
) -> tuple[Parts | None, float]:
    """Part of each tetrahedron, and the largest distance of the tetrahedra from the surfaces [m].

    Args:
        originals: Surfaces in the file, from which the distance is measured.
        surfaces: Surfaces that were filled, after simplification.
    """
    in_metres = [source.scale * one.x for one in originals]
    if len(surfaces) == 1:
        x = in_metres[0]
        deviation = farthest(x, tets.vertices, tets.tets)
        check_deviation(source, float(np.linalg.norm(np.ptp(x, axis=0))), deviation)
        return None, deviation
    scaled = [one._replace(x=source.scale * one.x) for one in surfaces]
    within = members(scaled, tets)
    try:
        parts = innermost(scaled, within)
        if not source.repair:
            each = volumes(tets.vertices, tets.tets)
            check_volumes(parts.names, within @ each, sizes(scaled))
    except VolumeLostError as error:
        raise error.of(source.path) from error
    away = (
        farthest(x, tets.vertices, tets.tets[chosen])
        for x, chosen in zip(in_metres, within, strict=True)
    )
    return parts, max(away)


def _filled(
    source: ObjectFile,
    surfaces: Sequence[PartSurface],
    report: SurfaceReport,
    progress: Progress,
    scan: ScanSurfaces | None = None,
) -> TetMesh:
    """Fill surfaces, in units of the file, with tetrahedra [m], within the options' limits."""
    x, faces = joined(surfaces)
    carved = scan is not None and len(surfaces) > 1
    expected = tetrahedra_expected(x, faces, report.volume, source.edge)
    phase = f"filling, {about(filling_seconds(len(faces), expected))}"
    progress(phase, 0.0)
    try:
        return tetrahedralise(
            x * source.scale,
            faces,
            source.edge,
            largest=source.repair,
            crossing=report.intersecting > 0 and _crosses(x, faces),
            within=(source.scale * surfaces[0].x, surfaces[0].faces) if carved else None,
            blur=0.0 if scan is None else source.scale * scan.blur,
            memory=source.max_memory,
            seconds=source.max_time,
            progress=lambda fraction: progress(phase, fraction),
        )
    except FillLimitError as error:
        coarser = f"--edge {min(0.5, 1.5 * source.edge):.2g}"
        fewer = f"--simplify {max(1000, len(faces) // 4)}"
        raise FillLimitError(
            f"{source.path}: {error}. Take {fewer} or {coarser}, or raise --max-memory or"
            " --max-time"
        ) from error
    except NothingFitsError as error:
        # A large edge loses thin parts. If the whole object is thin, a shorter edge may fill it.
        thin = 2.0 * envelope(source.edge)
        size = source.scale * float(np.linalg.norm(np.ptp(x, axis=0)))
        shorter = "Take a smaller --edge, or thicken" if source.edge > FINEST else "Thicken"
        advice = f" What is thinner than about {1e3 * thin * size:.2g} mm is lost. {shorter} it"
        raise VolumeLostError(str(error), advice, path=source.path) from error
    except SeveralPiecesError as error:
        if len(surfaces) > 1 or report.components > 1:
            raise BodyError(f"{source.path}: {error}") from error
        largest = "" if source.repair else ", or the largest of them with --repair"
        raise VolumeLostError(
            f"its tetrahedra are in {error.count} pieces",
            ": what joins them is too thin for elements of this size. Take a smaller --edge"
            f"{largest}",
            path=source.path,
        ) from error
    except BodyError as error:
        raise BodyError(f"{source.path}: {error}") from error


def _crosses(x: Floats, faces: Ints) -> bool:
    """Whether a surface with crossings still has crossings without its repeated triangles."""
    _, first = np.unique(np.sort(faces, axis=1), axis=0, return_index=True)
    return len(first) == len(faces) or examine(x, faces[first]).intersecting > 0


def check_file(path: Path) -> None:
    """Check that a file exists, is of a kind that can be read, and is not something else.

    Raises:
        BodyError: The file fails one of these checks.
    """
    kind = kind_of(path.name)
    if kind not in KINDS:
        raise BodyError(
            f"{path}: files of kind {kind or '(none)'} are not read; these are: {' '.join(KINDS)}"
        )
    check_link(path)
    if not path.is_file():
        raise BodyError(f"{path}: there is no such file")
    with path.open("rb") as file:
        check_start(path, file.read(START))
