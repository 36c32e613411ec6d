"""Finds everything that keeps a surface from being touched, and options that make it touchable.

A remedy is one such problem with the option that solves it. A file without a unit was probably
drawn in the unit that gives its object a usual size. If the user does not say which part is held,
the base or the feet, the flattest side, or one end is held.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from cohaptic_server.mesh.surface import face_area_vectors
from cohaptic_server.numeric import Floats, Ints
from cohaptic_server.objects.memory_limit import named
from cohaptic_server.objects.object_file import MAX_TRIANGLES, ObjectFile
from cohaptic_server.objects.parts.parts import PartSurface, joined
from cohaptic_server.objects.parts.surfaces import examine_all
from cohaptic_server.objects.scan.read import is_scan
from cohaptic_server.objects.surface.accept import MAX_SIZE, MIN_SIZE, check_not_flat
from cohaptic_server.objects.surface.checks import facing_outwards
from cohaptic_server.objects.surface.shell import SHEET, openness


@dataclass(frozen=True, slots=True)
class Remedy:
    """A problem of a file, with its solution.

    Args:
        problem: The problem as a phrase: "the object would be 170 m long".
        remedy: The solution as a phrase: "taken to be in millimetres".
        option: The option for this solution, as on a command line.
        needed: Whether the object cannot be touched without this option; otherwise it is advice.
    """

    problem: str
    remedy: str
    option: str
    needed: bool = True

    def sentence(self) -> str:
        """Problem, solution and option in one line, for a list."""
        return f"{self.problem}: {self.remedy} ({self.option})"


@dataclass(frozen=True, slots=True)
class Diagnosis:
    """All problems of a file, and the options with which it can be touched.

    Args:
        source: The file with the proposed options.
        remedies: One remedy for each problem; together they name the proposed options.
    """

    source: ObjectFile
    remedies: tuple[Remedy, ...] = ()

    @property
    def options(self) -> str:
        """The proposed options, as on a command line."""
        return " ".join(remedy.option for remedy in self.remedies)

    @property
    def needed(self) -> list[Remedy]:
        """Remedies without which the object cannot be touched."""
        return [remedy for remedy in self.remedies if remedy.needed]


# In files of these kinds y points up by specification or by custom, in all others z.
_Y_UP = (".glb", ".gltf", ".obj")
_LAYER = 0.01  # share of the extent; faces this close to a side belong to it
_FACING = 0.99  # cosine of the largest angle between a side and a face that rests on it
# Least flat share of the bounding box's side for a base: with less, a body stands on feet.
_FLAT = 0.15
# Least flat share of the lower side for feet, so that a table is held by its feet and not its top.
# A ball, which has no feet, has 0.015.
_STANDS = 0.025
# Least share of the surface that is held: with less, a body sways on its hold like a bell.
_LEAST_HELD = 0.04
_PERCENTAGES = (3, 5, 8, 10, 15, 20, 25, 30)
# Largest share of the surface that a base may hold: an object lying flat on more cannot deform.
_MAX_HELD = 0.3


class Side(NamedTuple):
    """One side of the bounding box.

    Args:
        axis: Axis at a right angle to the side: 0, 1 or 2.
        sign: -1 for the lower side, 1 for the upper side.
    """

    axis: int
    sign: int


def likely_base(x: Floats, faces: Ints, kind: str) -> tuple[str, str]:
    """Rule for `--fix` that holds an object where it would stand, and words that explain it.

    Args:
        x: Vertices, shape (n, 3), in any unit.
        faces: Triangles facing outwards, shape (m, 3).
        kind: Suffix of the file, in lower case.
    """
    down = Side(1 if kind in _Y_UP else 2, -1)
    flat = {side: flat_fraction(x, faces, side) for side in _sides()}
    chosen, words = down, "its lowest part is held"
    flattest = max(flat, key=lambda side: flat[side])
    if flat[down] >= _FLAT:
        words = "its base is held"
    elif flat[down] >= _STANDS:
        words = "its feet are held"
    elif flat[flattest] >= _FLAT:
        chosen, words = flattest, "its flattest side is held"
    rule, held = _rule(x, faces, chosen)
    if held > _MAX_HELD:
        longest = int(np.ptp(x, axis=0).argmax())
        chosen, words = Side(longest, -1), "it lies flat, so one end of it is held"
        rule, _ = _rule(x, faces, chosen)
    return rule, words


def flat_fraction(x: Floats, faces: Ints, side: Side) -> float:
    """Area of the faces that lie on a side of the bounding box, as a share of that side's area."""
    areas = face_area_vectors(x, faces)
    outwards = side.sign * areas[:, side.axis]
    length = np.linalg.norm(areas, axis=1)
    resting = (_away(x, faces, side) <= _LAYER) & (outwards > _FACING * length)
    width, depth = (np.ptp(x[:, axis]) for axis in range(3) if axis != side.axis)
    return float(outwards[resting].sum() / max(float(width * depth), 1e-300))


def _away(x: Floats, faces: Ints, side: Side) -> Floats:
    """Distance of each face's middle from a side, as a share of the object's extent, shape (m,)."""
    along = x[:, side.axis]
    fraction = (x[faces].mean(axis=1)[:, side.axis] - along.min()) / max(np.ptp(along), 1e-300)
    return np.asarray(fraction if side.sign < 0 else 1.0 - fraction)


def _sides() -> list[Side]:
    return [Side(axis, sign) for axis in (2, 1, 0) for sign in (-1, 1)]


def _rule(x: Floats, faces: Ints, side: Side) -> tuple[str, float]:
    """Rule that holds the thinnest layer with enough surface at a side, and the share held."""
    areas = np.linalg.norm(face_area_vectors(x, faces), axis=1)
    away = _away(x, faces, side)
    fractions = {p: float(areas[away < 0.01 * p].sum() / areas.sum()) for p in _PERCENTAGES}
    enough = (p for p, fraction in fractions.items() if fraction >= _LEAST_HELD)
    percentage = next(enough, _PERCENTAGES[-1])
    name = "xyz"[side.axis]
    rule = f"{name} < {percentage}%" if side.sign < 0 else f"{name} > {100 - percentage}%"
    return rule, fractions[percentage]


# Number of triangles above which a surface is simplified, and the number after it. Filling takes 5
# to 17 ms for each triangle, and elements of the default edge have about a thousand triangles at
# the surface of a compact object.
MANY, FEWER = 6000, 4000
_THICKNESS = 0.03  # thickness of the shell made from a sheet, as a share of its longest side


def diagnose(
    source: ObjectFile,
    surfaces: Sequence[PartSurface],
    *,
    scale_given: bool = False,
    is_volume: bool = False,
) -> Diagnosis:
    """Find all problems of a surface.

    Args:
        source: The file and its options; problems that the options already solve are left out.
        surfaces: Surfaces of the parts, or one for the whole object, in units of the file.
        scale_given: Whether the user has given the scale, which must then stay.
        is_volume: Whether the surface is the boundary of a volume mesh, which stays as it is.

    Raises:
        BodyError: The surface encloses no volume, and is no sheet that can be made a shell.
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
    """Options and remedies for a surface that is too fine or does not enclose a single volume."""
    remedies: list[Remedy] = []
    x, faces = joined(surfaces)
    is_label_map = is_scan(source.path)  # its surfaces come from voxels, with few triangles
    if is_label_map:
        surfaces = surfaces[:1]
    if not source.simplify and len(faces) > MANY and not is_label_map:
        source = replace(source, simplify=FEWER)
        problem = f"it has {len(faces):,} triangles, more than elements for touching can follow"
        words, option = f"simplified to {FEWER:,}", f"--simplify {FEWER}"
        remedies.append(Remedy(problem, words, option, needed=len(faces) > MAX_TRIANGLES))
    with named(source.path):
        report = examine_all(surfaces)
    if report.open_edges and not source.shell and openness(x, faces) > SHEET:
        thickness = float(f"{_THICKNESS * size * source.scale:.2g}")
        source = replace(source, shell=thickness)
        words, option = f"made a shell {1e3 * thickness:.3g} mm thick", f"--shell {thickness:g}"
        remedies.append(Remedy("it is a sheet, open all round its rim", words, option))
    if source.shell:
        report = replace(report, open_edges=0)  # a shell has no rim any more
    else:
        check_not_flat(f"{source.path}: ", report)
    problems = report.problems()
    if report.components > 1:
        problems.append(f"the surface is in {report.components} pieces")
    if problems and not source.repair:
        source = replace(source, repair=True)
        words = "closed and untangled by fTetWild"
        remedies.append(Remedy("; ".join(problems), words, "--repair"))
    return source, remedies


_LIKELY = (0.02, 1.0)  # m; longest side of most objects that are touched with a hand
_UNITS = ((1e-3, "millimetres"), (1e-2, "centimetres"))
_UNKNOWN_SIZE = 0.2  # m; length of an object that fits between two hands


def likely_scale(size: float) -> tuple[float, Remedy] | None:
    """Probable metres in one unit of a file, and the remedy; None if the unit can be the metre.

    Args:
        size: Longest side of the object's bounding box, in units of the file.
    """
    low, high = _LIKELY
    # A file in single precision may round a size at the limit.
    if (1.0 - 1e-6) * MIN_SIZE <= size <= high:
        return None
    problem = f"in metres the object would be {size:.3g} m long"
    if size > MAX_SIZE:
        for scale, unit in _UNITS:
            if low <= scale * size <= high:
                remedy = f"taken to be in {unit}, {1e3 * scale * size:.3g} mm long"
                return scale, Remedy(problem, remedy, f"--scale {scale:g}")
    # The number is short, so that a user who reads the option can type it.
    scale = float(f"{_UNKNOWN_SIZE / size:.2g}")
    possible = high < size <= MAX_SIZE
    if possible:
        problem += ", more than a hand reaches"
    remedy = f"made {1e3 * scale * size:.3g} mm long"
    return scale, Remedy(problem, remedy, f"--scale {scale:g}", needed=not possible)
