"""Everything that keeps a surface from being touched, and the options that make it touchable."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from cohaptic_server.objects.auto.base import likely_base
from cohaptic_server.objects.auto.remedy import Diagnosis, Remedy
from cohaptic_server.objects.auto.units import likely_scale
from cohaptic_server.objects.object_file import MAX_TRIANGLES, ObjectFile
from cohaptic_server.objects.parts.parts import PartSurface, joined
from cohaptic_server.objects.parts.surfaces import examine_all
from cohaptic_server.objects.scan.read import is_scan
from cohaptic_server.objects.surface.checks import facing_outwards
from cohaptic_server.objects.surface.shell import SHEET, openness

# Triangles above which a surface is simplified, and to how many. Filling takes 5 to 17 ms for each,
# and elements of the default edge have about a thousand triangles on a compact object.
MANY, FEWER = 6000, 4000
_THICKNESS = 0.03  # of a sheet that becomes a shell, as a share of its longest side


def diagnose(
    source: ObjectFile,
    surfaces: Sequence[PartSurface],
    *,
    scale_given: bool = False,
    is_volume: bool = False,
) -> Diagnosis:
    """Find everything that is wrong with a surface.

    Args:
        source: The file and its options; what they already do something about is not found again.
        surfaces: In units of the file; of several parts, or one.
        scale_given: Whether the scale is the user's own word, and must stay.
        is_volume: Whether the surface is that of tetrahedra, which are taken as they are.
    """
    remedies: list[Remedy] = []
    x, faces = joined(surfaces)
    size = float(np.ptp(x, axis=0).max())
    units = None if scale_given or source.scale != 1.0 else likely_scale(size)
    if units is not None:
        source = replace(source, scale=units[0])
        remedies.append(units[1])
    if not is_volume:
        source, mended = _mended(source, surfaces, size)
        remedies += mended
    if not source.fix.strip() and source.fix_mesh is None:
        rule, words = likely_base(x, facing_outwards(x, faces), source.path.suffix.lower())
        source = replace(source, fix=rule)
        problem = "nothing says what of it is held, and it would float away"
        remedies.append(Remedy(problem, words, f'--fix "{rule}"'))
    return Diagnosis(source, tuple(remedies))


def _mended(
    source: ObjectFile, surfaces: Sequence[PartSurface], size: float
) -> tuple[ObjectFile, list[Remedy]]:
    """What is done about a surface that is too fine, or does not enclose one volume."""
    remedies: list[Remedy] = []
    x, faces = joined(surfaces)
    is_label_map = is_scan(source.path)  # whose surfaces were made here, and made few
    if is_label_map:
        surfaces = surfaces[:1]
    if not source.simplify and len(faces) > MANY and not is_label_map:
        source = replace(source, simplify=FEWER)
        problem = f"it has {len(faces):,} triangles, more than elements for touching can follow"
        words, option = f"simplified to {FEWER:,}", f"--simplify {FEWER}"
        remedies.append(Remedy(problem, words, option, needed=len(faces) > MAX_TRIANGLES))
    report = examine_all(surfaces)
    if report.open_edges and not source.shell and openness(x, faces) > SHEET:
        thickness = float(f"{_THICKNESS * size * source.scale:.2g}")
        source = replace(source, shell=thickness)
        words, option = f"made a shell {1e3 * thickness:.3g} mm thick", f"--shell {thickness:g}"
        remedies.append(Remedy("it is a sheet, open all round its rim", words, option))
    if source.shell:
        report = replace(report, open_edges=0)  # a shell has no rim any more
    problems = report.problems()
    if report.components > 1:
        problems.append(f"the surface is in {report.components} pieces")
    if problems and not source.repair:
        source = replace(source, repair=True)
        words = "closed and untangled by fTetWild"
        remedies.append(Remedy("; ".join(problems), words, "--repair"))
    return source, remedies
