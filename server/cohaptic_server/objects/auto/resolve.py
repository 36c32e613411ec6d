"""Finds options with which a file can be touched: all findings at once, and a remedy for each.

Without `--auto` one error lists the findings, with the option for each. With `--auto` the options
are used, the mesh is made coarse enough for the memory, and the user is told which options.

The softness is chosen last, from a build of the object (`softness.py`). The store keeps that build,
of which the build with the chosen softness is a multiple.

An object that loses more than a small share of its volume needs `--repair`. `check_kept` refuses an
object that loses too much, unless `--repair` was given from the start.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, astuple, replace
from pathlib import Path

import numpy as np

from cohaptic.errors import BodyError
from cohaptic_server.bodies.body import Body
from cohaptic_server.mesh.tetrahedra import boundary
from cohaptic_server.numeric import Floats, Ints
from cohaptic_server.objects.auto.diagnose import Diagnosis, Remedy, diagnose
from cohaptic_server.objects.auto.softness import fitting_young, softness_words
from cohaptic_server.objects.build import build, expected_cost
from cohaptic_server.objects.build_rubber import TooFineError, affordable, build_affordable
from cohaptic_server.objects.cost import Demand, edge_that_fits, growth_between
from cohaptic_server.objects.fix_mesh import FixMesh
from cohaptic_server.objects.fix_rule import check_fix_given, fixed_by_rule
from cohaptic_server.objects.fix_surface import FixSurface, UnfitSurfaceError
from cohaptic_server.objects.memory_limit import named
from cohaptic_server.objects.object_file import MAX_READ, OPTIONS, ObjectFile
from cohaptic_server.objects.option import Option
from cohaptic_server.objects.parts.nodes import read_surfaces
from cohaptic_server.objects.parts.parts import PartSurface, VolumeLostError, joined
from cohaptic_server.objects.parts.surfaces import simplified_to
from cohaptic_server.objects.prepare import Prepared, check_file
from cohaptic_server.objects.scan.choose import labels_together, listed
from cohaptic_server.objects.scan.read import is_scan, read_scan
from cohaptic_server.objects.scan.scan_surfaces import FEWER, scan_surfaces
from cohaptic_server.objects.store.cache import entry_path, load_entry, save_entry
from cohaptic_server.objects.store.store import READERS, load_or_prepare
from cohaptic_server.objects.surface.simplify import count_triangles
from cohaptic_server.objects.volume_checks import PiecesError
from cohaptic_server.objects.volume_file import read_volume
from cohaptic_server.progress import Progress
from cohaptic_server.touchable import VOLUMES

_ATTEMPTS = 6  # attempts to find a mesh that is coarse enough
# A block of 8 x 6 x 5 cells of linear tetrahedra, pressed over the contact radius of its mesh, is
# 24, 36 and 59 % stiffer at Poisson's ratios of 0.3, 0.45 and 0.49 than the limit of quadratic
# ones, and three times as much under a fingertip of 8 mm (docs/performance.md).
LINEAR_ONES = (
    "made of linear tetrahedra, which are a third stiffer than the object under a contact as wide"
    " as they are, and more under a narrower one"
)
_FORM = 10  # version of the entry; raised when the findings or their remedies change


def find_problems(source: ObjectFile, *, scale_given: bool = False) -> Diagnosis:
    """Find all problems of a file, and propose options.

    Args:
        scale_given: Whether the user has given the scale, which must then stay.

    Raises:
        BodyError: The file cannot be read, or is far too large.
        SettingError: The rule for the held region cannot be parsed, or holds nothing or everything;
            or a material does not fit the parts.
    """
    labelled, source = labels_of(source)
    try:
        surfaces = read_outside(source)
    except PiecesError as error:
        source = replace(source, repair=True)
        surfaces = read_outside(source)  # refused again if no piece is most of the object
        labelled = (Remedy(error.problem, "the largest is taken alone", "--repair"),)
    is_volume = source.path.suffix.lower() in VOLUMES
    found = diagnose(source, surfaces, scale_given=scale_given, is_volume=is_volume)
    found = replace(found, remedies=(*labelled, *found.remedies))
    # A mistyped part or rule is reported before the slow steps.
    if not is_volume:
        source.parts.check([one.name for one in surfaces if one.name])
    return _held(found, *joined(surfaces))


def _held(found: Diagnosis, x: Floats, faces: Ints) -> Diagnosis:
    """Check what holds the object; propose unit and axes of a surface that holds nothing, or all.

    Args:
        x: Vertices of the object, shape (n, 3), in units of the file.
        faces: Triangles of its outer surface, shape (m, 3).

    Raises:
        SettingError: Nothing or everything is held, and no unit and axes that the user and the
            files leave open mend it, or several do.
    """
    source = found.source
    check_fix_given(source)
    if source.fix_mesh is None:
        fixed_by_rule(source.fix, x[np.unique(faces)] * source.scale)
        return found
    surface = FixSurface.of(source)
    used, outside = np.unique(faces, return_inverse=True)
    try:
        surface.fixed(x[used] * source.scale, outside.reshape(-1, 3))
    except UnfitSurfaceError as error:
        if len(error.ways) != 1 or not surface.leaves_open(error.ways[0]):
            raise
        (way,) = error.ways
        mended = replace(source, fix_mesh=Path(str(way)))
        remedy = Remedy(error.problem, f"taken {way.words()}", way.option)
        return Diagnosis(mended, (*found.remedies, remedy))
    return found


def labels_of(source: ObjectFile) -> tuple[tuple[Remedy, ...], ObjectFile]:
    """Propose labels if a map has several and the user chose none; return remedies and options."""
    if not is_scan(source.path) or source.labels:
        return (), source
    check_file(source.path)
    labels = read_scan(source.path)
    if len(labels.labels) == 1:
        return (), source
    together = labels_together(labels)
    options = tuple(str(label.value) for label in together)
    problem = f"it has {len(labels.labels)} labels: {listed(labels, labels.labels)}"
    words = f"{listed(labels, together)} hang together and are taken"
    option = " ".join(f"--label {value}" for value in options)
    return (Remedy(problem, words, option),), replace(source, labels=options)


def read_outside(source: ObjectFile) -> tuple[PartSurface, ...]:
    """Read the surface of the object in a file, or those of its parts, in units of the file.

    Args:
        source: A surface, a label map, or a volume mesh, whose boundary is returned.

    Raises:
        BodyError: The file cannot be read, or is far too large.
    """
    path = source.path
    check_file(path)
    if is_scan(path):
        surfaces = scan_surfaces(path, source.labels).surfaces
        with named(path):
            return simplified_to(surfaces, source.simplify or FEWER)
    if path.suffix.lower() in VOLUMES:
        x, tets, _ = read_volume(path, largest=source.repair)
        return (PartSurface("", x, boundary(tets)),)
    count = count_triangles(path)
    if count > MAX_READ:
        raise BodyError(
            f"{path}: {count:,} triangles; the limit is {MAX_READ:,}. Simplify it first"
        )
    return read_surfaces(path)


def resolve(
    source: ObjectFile,
    progress: Progress = lambda phase, fraction: None,
    *,
    scale_given: bool = False,
    softness: bool = False,
    demand: Demand | None = None,
) -> Diagnosis:
    """Find options with which a file can be touched within its memory limit, and store them.

    Args:
        source: The file and the options that the user gave.
        progress: Called with the phase and the share of it that is done.
        scale_given: Whether the user has given the scale, which must then stay.
        softness: Whether to choose a softness as well, with which a press is felt.
        demand: Number of users and tick rate. The mesh of a nonlinear solid must be solved within a
            tick, and then takes so little memory that the memory limit is not checked.

    Raises:
        BodyError: No options make the object in the file touchable.
        SettingError: An option does not fit the file.
    """
    check_file(source.path)
    rubber = demand if demand is not None and demand.nonlinear else None
    reader = READERS.get(source.path.suffix.lower(), 1)
    given = (scale_given, softness)
    options = repr((_FORM, reader, given, rubber, *astuple(source))).encode()
    path = entry_path(options, source.path.read_bytes(), *_second_file(source))
    kept = load_entry(path, "findings", mapped=False)
    if kept is not None:
        return _from_text(source, kept["text"].tobytes().decode())
    progress("looking at the file", 0.0)
    found = find_problems(source, scale_given=scale_given)
    progress("tetrahedra", 0.0)
    found = _within(found, progress) if rubber is None else _as_rubber(found, rubber, progress)
    if softness:
        found = _as_soft_as_felt(found, rubber, progress)
    save_entry(path, "findings", {"text": np.frombuffer(_to_text(found).encode(), np.uint8)})
    return found


def _second_file(source: ObjectFile) -> list[bytes]:
    """The bytes of the surface that holds the object, if the user gives one that exists."""
    path = None if source.fix_mesh is None else FixMesh.of(source.fix_mesh).path
    return [path.read_bytes()] if path is not None and path.is_file() else []


def _within(found: Diagnosis, progress: Progress) -> Diagnosis:
    """Extend the options so that the mesh can be factored within the memory limit."""
    source, memory = found.source, found.source.max_memory
    mesh = list[Remedy]()
    lost: VolumeLostError | None = None
    tried: list[tuple[float, float]] = []  # edges, and the memory of their meshes
    for _ in range(_ATTEMPTS):
        try:
            prepared = load_or_prepare(source, progress)
        except VolumeLostError as error:
            if source.repair:
                raise
            source, lost = replace(source, repair=True), error
            continue
        if lost is not None:
            check_kept(source, prepared, lost)
        count, needed = len(prepared.tets.tets), expected_cost(source, prepared).memory
        if needed <= memory:
            volume = () if lost is None else (_lost(lost),)
            return Diagnosis(source, (*found.remedies, *volume, *mesh))
        problem = f"{count:,} tetrahedra would take about {needed / 1e9:.2g} GB to prepare"
        if source.path.suffix.lower() in VOLUMES:
            if source.material.order == 1:
                break
            source = replace(source, material=replace(source.material, order=1))
            mesh = [Remedy(problem, LINEAR_ONES, "--order 1")]
            continue
        tried.append((source.edge, needed))
        edge = _longer(tried, memory)
        source = replace(source, edge=edge)
        mesh = [Remedy(problem, "made coarser", f"--edge {edge:g}")]
    raise BodyError(
        f"{source.path}: no mesh of it fits into {memory / 1e9:g} GB. Take a simpler object, or"
        " choose --edge and --order yourself, without --auto"
    )


def _as_rubber(found: Diagnosis, demand: Demand, progress: Progress) -> Diagnosis:
    """Extend the options so that a tick can solve the mesh; the build chooses the edge again.

    The store keeps the tetrahedra that are filled here for the build.
    """
    source, more = found.source, list[Remedy]()
    lost: VolumeLostError | None = None
    while True:  # each of the two remedies is taken at most once
        try:
            tried, prepared, _ = affordable(source, demand, progress)
        except VolumeLostError as error:
            if source.repair:
                raise
            source, lost = replace(source, repair=True), error
            more.append(_lost(error))
        except TooFineError as error:
            if source.material.order == 1:
                raise
            source = replace(source, material=replace(source.material, order=1))
            others = [way for way in error.ways if way != "--order 1"]
            words = f"{LINEAR_ONES}{'; other ways: ' if others else ''}{' or '.join(others)}"
            more.append(Remedy(error.problem, words, "--order 1"))
        else:
            if lost is not None:
                check_kept(tried, prepared, lost)
            return Diagnosis(source, (*found.remedies, *more))


def _as_soft_as_felt(found: Diagnosis, rubber: Demand | None, progress: Progress) -> Diagnosis:
    """Extend the options by a softness, which a build with the one in the options leads to."""
    source, young = found.source, found.source.material.young
    body: Body
    if rubber is None:
        body = build(source, progress, late=True).solid
    else:
        body = build_affordable(source, demand=rubber, progress=progress)[1]
    fitting = fitting_young(body, young)
    source = replace(source, material=replace(source.material, young=fitting))
    words = f"{softness_words(fitting)}, so that a press is felt"
    remedy = Remedy("nothing says how soft it is", words, f"--young {fitting:g}", needed=False)
    return Diagnosis(source, (*found.remedies, remedy))


def _lost(error: VolumeLostError) -> Remedy:
    return Remedy(error.problem, "taken as it is", "--repair")


def _longer(tried: Sequence[tuple[float, float]], memory: float) -> float:
    """Next edge length to try, from how much the memory fell between the last two meshes."""
    if len(tried) < 2 or tried[-1][0] <= tried[-2][0]:
        return edge_that_fits(*tried[-1], memory)
    return edge_that_fits(*tried[-1], memory, growth_between(*tried[-2], *tried[-1]))


def _to_text(found: Diagnosis) -> str:
    source = found.source
    chosen = {_key(one): one.value(source) for one in OPTIONS if one.chosen}
    # This option is not marked as `chosen`, since the process that reads an upload would then name
    # a file which the server reads.
    if source.fix_mesh is not None:
        chosen["fix_mesh"] = str(source.fix_mesh)
    return json.dumps({"chosen": chosen, "remedies": [asdict(one) for one in found.remedies]})


def _from_text(source: ObjectFile, text: str) -> Diagnosis:
    known = json.loads(text)
    values = known["chosen"]
    chosen = {one.attribute: one.typed(values[_key(one)]) for one in OPTIONS if _key(one) in values}
    remedies = tuple(Remedy(**one) for one in known["remedies"])
    return Diagnosis(source.changed(chosen), remedies)


def _key(option: Option) -> str:
    """Key of an option in a stored text: `order` for `material.order`."""
    return option.attribute.rpartition(".")[2]


# Thin parts of an object may be lost, such as fingers and a rim, but not its main shape: a leaflet
# must not become a lump, nor an object lose one of two halves that a thread joins.
LEAST_KEPT = 0.5  # share of the volume
MAX_AWAY = 0.2  # distance from the surface to the remaining object, as a share of the diagonal


def check_kept(source: ObjectFile, prepared: Prepared, lost: VolumeLostError) -> None:
    """Refuse a mesh that has lost so much of an object that it is not the same object any more.

    A surface that needs `--repair` from the start is not checked: the volume inside an open or
    crossing surface is unknown, and separate pieces are dropped on purpose.

    Args:
        prepared: Mesh of the remaining object.
        lost: The error that says why some of the object is lost.

    Raises:
        BodyError: Less than half of the volume is left, or some of the surface is too far from the
            mesh.
    """
    x = prepared.tets.vertices[np.unique(prepared.tets.tets)]
    # The object is longer than the remaining one by at most the deviation.
    longest = float(np.linalg.norm(np.ptp(x, axis=0))) + prepared.deviation
    enclosed = 0.0 if prepared.surface is None else abs(prepared.surface.volume) * source.scale**3
    kept = min(1.0, prepared.tets.volume / enclosed) if enclosed > 0.0 else 1.0
    if kept >= LEAST_KEPT and prepared.deviation <= MAX_AWAY * longest:
        return
    raise BodyError(
        f"{source.path}: {lost.problem}, and what is left is not the object any more: {kept:.0%} of"
        f" its volume, up to {1e3 * prepared.deviation:.2g} mm from its surface. Thicken what is"
        " thin, give a sheet a thickness with --shell, or take what there is with --repair and"
        " without --auto"
    )
