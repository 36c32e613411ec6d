"""The closed surface of `--fix-mesh` in the frame of the object that it holds.

A point is inside the surface if its winding number is not zero. This number is the sum of the
triangles' signed solid angles, seen from the point, over 4 pi (Van Oosterom, Strackee 1983). The
test also works for a surface that is inside out.

Unit and axes of the surface are those that the user says (`fix_mesh.py`). What is not said follows
from the files:

    unit: glTF and 3MF say theirs. Else the surface has the unit of the object's file, as files of
        one program have. Where that is the metre, by the format of the object's file, a surface
        that says its axes is in millimetres: programs for scans write axes and measure in them.
    axes: Those that both files say. Else the surface has the axes of the object. A label map is
        read in RAS.

A wrong unit nearly always holds nothing or everything, and is then refused. Wrong axes may hold a
place at the opposite side, so they are told to the user where nothing says them.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from cohaptic.errors import BodyError, SettingError
from cohaptic_server.numeric import Floats, Ints, Mask
from cohaptic_server.objects.fix_mesh import LPS, RAS, UNITS, FixMesh, said_axes
from cohaptic_server.objects.memory_limit import say_once
from cohaptic_server.objects.object_file import ObjectFile
from cohaptic_server.objects.surface.checks import edge_counts
from cohaptic_server.objects.surface.surface_file import SCENES, read_surface
from cohaptic_server.touchable import SCANS, SURFACES, kind_of

MAX_FIX_TRIANGLES = 100_000  # a rough surface is enough to select vertices
_PAIRS_PER_BLOCK = 2**21  # pairs of a point and a triangle; one array of vectors takes 50 MB
_WITH_UNIT = ".3mf"  # a file of this kind says its unit
_IN_METRES = (*SCENES, _WITH_UNIT)  # coordinates of these kinds are read in metres
_TURN = np.array([-1.0, -1.0, 1.0])  # from RAS to LPS, and back


def inside(y: Floats, faces: Ints, x: Floats) -> Mask:
    """Whether each point is inside a closed surface, shape (n,).

    Args:
        y: Vertices of the surface, shape (m, 3).
        faces: Triangles of the surface, shape (f, 3).
        x: Points, shape (n, 3).
    """
    is_inside = np.zeros(len(x), dtype=np.bool_)
    in_box = np.flatnonzero(_in_box(y, x))
    step = max(1, _PAIRS_PER_BLOCK // len(faces))
    for start in range(0, len(in_box), step):
        points = in_box[start : start + step]
        winding = np.zeros(len(points))
        for first in range(0, len(faces), _PAIRS_PER_BLOCK):
            block = faces[first : first + _PAIRS_PER_BLOCK]
            winding += _half_angles(y, block, x[points]) / (2.0 * np.pi)  # a whole turn is 4 pi
        is_inside[points] = np.abs(winding) > 0.5
    return is_inside


def _half_angles(y: Floats, faces: Ints, x: Floats) -> Floats:
    """Half of the sum of the triangles' signed solid angles, seen from each point, shape (n,)."""
    a, b, c = (y[faces[:, k]][None] - x[:, None] for k in range(3))
    la, lb, lc = (np.sqrt(np.einsum("pfi,pfi->pf", v, v)) for v in (a, b, c))
    numerator = np.einsum("pfi,pfi->pf", a, np.cross(b, c))
    denominator = (
        la * lb * lc
        + np.einsum("pfi,pfi->pf", a, b) * lc
        + np.einsum("pfi,pfi->pf", b, c) * la
        + np.einsum("pfi,pfi->pf", c, a) * lb
    )
    return np.asarray(np.arctan2(numerator, denominator).sum(axis=1))


def _in_box(y: Floats, x: Floats) -> Mask:
    """Whether each point of x is in the bounding box of y, shape (n,)."""
    return np.asarray(((x >= y.min(axis=0)) & (x <= y.max(axis=0))).all(axis=1))


def axes_of_object(path: Path) -> str:
    """Axes of a patient that an object's file has, `ras` or `lps`; empty if it says none."""
    return RAS if kind_of(path.name) in SCANS else said_axes(path)


class UnfitSurfaceError(SettingError):
    """Nothing of an object, or all of it, lies inside the surface that is to hold it.

    Args:
        given: The value of the option.
        limit: What it must be, as the end of a sentence.
        problem: The fault, as the beginning of a sentence.
        ways: Units and axes with which the surface would hold some of the object.

    Attributes:
        problem: The fault, as the beginning of a sentence.
        ways: Units and axes with which the surface would hold some of the object.
    """

    def __init__(self, given: FixMesh, limit: str, problem: str, ways: tuple[FixMesh, ...]) -> None:
        super().__init__("--fix-mesh", str(given), limit)
        self.problem = problem
        self.ways = ways


@dataclass(frozen=True, eq=False)
class FixSurface:
    """The surface that holds an object, and what is known of the coordinates in both files.

    Args:
        given: The file, with the unit and axes that the user says.
        y: Vertices as the file has them, shape (m, 3).
        faces: Triangles, shape (f, 3).
        axes: Axes that the file says, `ras` or `lps`; empty for none.
        source: File of the object, and its options.
        axes_of_object: Axes that the object's file has; empty if it says none.
    """

    given: FixMesh
    y: Floats
    faces: Ints
    axes: str
    source: ObjectFile
    axes_of_object: str

    @classmethod
    def of(cls, source: ObjectFile) -> FixSurface:
        """Read the surface in `fix_mesh` of an object, and say what the file says of its axes.

        Raises:
            SettingError: The option cannot be read, or gives a unit to a file that says its own.
            BodyError: The file has no closed surface, or too many triangles.
        """
        assert source.fix_mesh is not None
        given = FixMesh.of(source.fix_mesh)
        if given.unit and kind_of(given.path.name) == _WITH_UNIT:
            without = f"without a unit, since a {_WITH_UNIT} file says its own"
            raise SettingError("--fix-mesh", str(given), without)
        y, faces = read_fix_mesh(given.path)
        axes, of_object = said_axes(given.path), axes_of_object(source.path)
        surface = cls(given, y, faces, axes, source, of_object)
        if axes:
            say_once(given.path, surface._said())
        return surface

    def placed(self, given: FixMesh | None = None) -> Floats:
        """Vertices in the frame of the object, shape (m, 3) [m].

        Args:
            given: Another unit and other axes than those of `self.given`.
        """
        given = given or self.given
        x = self.metres(given.unit) * self.y
        return x * _TURN if self._read_in(given.axes) != self._target else x

    def metres(self, unit: str) -> float:
        """Length of one unit of the surface's file in the frame of the object [m].

        Args:
            unit: One of `UNITS`; empty if the user says none.
        """
        in_metres = self._object_kind in (*SCANS, *_IN_METRES)
        # Where the unit of the object is known the scale enlarges it, and the surface with it.
        # Otherwise the scale is the unit.
        enlarged = self.source.scale if in_metres else 1.0
        if unit:
            return enlarged * UNITS[unit]
        if kind_of(self.given.path.name) in _IN_METRES:
            return enlarged
        return enlarged * UNITS["mm"] if in_metres and self.axes else self.source.scale

    @property
    def _object_kind(self) -> str:
        return kind_of(self.source.path.name)

    @property
    def _target(self) -> str:
        """Axes of the object; RAS if nothing says them, so that `lps` turns the surface round."""
        return self.axes_of_object or RAS

    def _read_in(self, axes: str) -> str:
        """Axes in which the surface is read if the user says `axes`, or none."""
        return axes or (self.axes if self.axes_of_object else "") or self._target

    @property
    def _may_be_turned(self) -> bool:
        """Whether nothing says the axes of the surface, and it holds a scan, whose are known."""
        return self._object_kind in SCANS and not self.given.axes and not self.axes

    def _said(self) -> str:
        """Sentence on the axes that the file says, and what becomes of them."""
        said, name = f"it says SPACE={self.axes.upper()}", self.source.path.name
        if self.given.axes:
            return f"{said}, and is read as {self.given.axes.upper()}, as --fix-mesh says"
        if not self.axes_of_object:
            turned = replace(self.given, axes=LPS).option
            same = "both are taken to have the same"
            return f"{said}, and {name} says no axes: {same}; {turned} turns x and y round"
        change = "x and y are turned round to" if self.axes != self._target else "these are also"
        in_mm = not self.given.unit and self.metres("") == self.metres("mm")
        return f"{said}: {change} the axes of {name}{', and it is in millimetres' * in_mm}"

    def fixed(self, x: Floats, outside: Ints) -> Mask:
        """Whether each vertex of the object lies inside the surface, shape (n,).

        None does where the whole surface lies within the object, between its vertices.

        Args:
            x: Vertices of the object, shape (n, 3) [m].
            outside: Triangles of the object's outer surface, shape (k, 3).

        Raises:
            UnfitSurfaceError: The surface lies beside the object, or all of it in the surface.
        """
        y = self.placed()
        fixed = inside(y, self.faces, x)
        if fixed.all() or (not fixed.any() and not _lies_within(y, x, outside)):
            raise self._unfit(x, self._ways(x, outside), nothing=not fixed.any())
        turned = replace(self.given, axes=LPS)
        if self._may_be_turned and self._holds(turned, x, outside):
            say_once(
                self.given.path,
                "nothing says its axes: they are taken as right-anterior-superior (RAS), those of"
                f" {self.source.path.name}. Surfaces of 3D Slicer and ITK are left-posterior-"
                f"superior (LPS), and would hold another place: {turned.option}",
            )
        return fixed

    def leaves_open(self, way: FixMesh) -> bool:
        """Whether neither the user nor the files say another unit or other axes.

        Args:
            way: Unit and axes from the `ways` of an error.
        """
        known = self.axes if self.axes_of_object and not self.given.axes else ""
        return way.keeps(self.given) and (not known or way.axes in ("", known))

    def _holds(self, given: FixMesh, x: Floats, outside: Ints) -> bool:
        """Whether some of the object, and not all of it, lies inside the surface."""
        y = self.placed(given)
        near = np.flatnonzero(_in_box(y, x))
        # A sample shows it, and is fast where surfaces are fine.
        within = inside(y, self.faces, x[_sample(near, _PAIRS // len(self.faces))])
        if within.any():
            return len(near) < len(x) or not bool(within.all())
        return _lies_within(y, x, outside)

    def _ways(self, x: Floats, outside: Ints) -> tuple[FixMesh, ...]:
        """Units and axes with which the surface holds some of the object, the likeliest first."""
        given = self.given
        other = LPS if self._read_in(given.axes) == RAS else RAS
        # Axes that something says, or that two files without a word on them share, are turned only
        # if nothing else is left.
        turns = ((RAS, LPS),) if self._may_be_turned else ((given.axes,), (other,))
        least = _LEAST * np.linalg.norm(np.ptp(x, axis=0)) / np.linalg.norm(np.ptp(self.y, axis=0))
        units = [unit for unit in self._units() if self.metres(unit) >= least]
        for axes in turns:
            tried = [FixMesh(given.path, unit, one) for unit in units for one in axes]
            if found := tuple(one for one in tried if self._holds(one, x, outside)):
                return found
        return ()

    def _units(self) -> list[str]:
        """Units to try, the likeliest first; empty for the one that is taken if none is said."""
        if kind_of(self.given.path.name) == _WITH_UNIT:
            return [""]
        likely = [self.given.unit, *(["mm", ""] if self._may_be_turned else ["", "mm"])]
        each: dict[float, str] = {}
        for unit in (*likely, "cm", "m", "in"):
            each.setdefault(self.metres(unit), unit)
        return list(each.values())

    def _unfit(self, x: Floats, ways: tuple[FixMesh, ...], *, nothing: bool) -> UnfitSurfaceError:
        """Error about a surface that holds nothing, or everything, with the ways out."""
        own, objects = _box(self.placed()), _box(x)
        wanted, held = "one that leaves something free to move", "all of it lies"
        if nothing:
            wanted = "a surface with some of the object in it, or it would float away"
            held = "nothing of it lies"
        problem = f"{held} within {self.given.path.name}, which has {own}; the object has {objects}"
        limit = f"{wanted}; it has {own}, the object {objects}{self._named(ways)}"
        return UnfitSurfaceError(self.given, limit, problem, ways)

    def _named(self, ways: tuple[FixMesh, ...]) -> str:
        """End of a sentence that names the options with which some of the object is held."""
        if not ways:
            return ""
        several = len({one.unit for one in ways}) > 1
        long = [f" ({1e3 * np.ptp(self.placed(one), axis=0).max():.3g} mm long)" for one in ways]
        named = [f"{one.option}{words * several}" for one, words in zip(ways, long, strict=True)]
        sentence = f"; with {' or '.join(named)} some of it would be"
        if len({one.axes for one in ways}) > 1:
            sentence += (
                f". Surfaces of 3D Slicer and ITK are {LPS}, those with the axes of NIfTI {RAS};"
                " cohaptic body inspect --out draws the place"
            )
        return sentence


def read_fix_mesh(path: Path) -> tuple[Floats, Ints]:
    """Read a closed surface: vertices as in the file, shape (m, 3), and triangles, shape (f, 3).

    Raises:
        BodyError: The file is of no kind that is read, has no closed surface, or too many
            triangles.
    """
    if not path.is_file():
        raise BodyError(f"{path}: there is no such file")
    if kind_of(path.name) not in SURFACES:
        raise BodyError(
            f"{path}: a surface that holds is read from files of these kinds: {' '.join(SURFACES)}"
        )
    y, faces = read_surface(path)
    if len(faces) > MAX_FIX_TRIANGLES:
        raise BodyError(
            f"{path}: {len(faces):,} triangles; to say what is held {MAX_FIX_TRIANGLES:,} must do"
        )
    counts = edge_counts(faces)
    if (counts != 2).any():
        raise BodyError(
            f"{path}: the surface that holds is not closed: {(counts != 2).sum()} of its edges do"
            " not have two triangles"
        )
    return y, faces


_PAIRS = 2**24  # pairs of a point and a triangle that are tested for one choice of unit and axes
_MAX_SEEN = 64  # vertices of a surface that show whether it lies within the object
# Least diagonal of a surface that is proposed, as a share of the object's: a smaller one lies
# between the vertices of elements of the default edge, and by its unit near the origin only.
_LEAST = 0.05


def _lies_within(y: Floats, x: Floats, outside: Ints) -> bool:
    """Whether a surface lies within an object, at least in part, by some vertices of it."""
    seen = _sample(np.flatnonzero(_in_box(x, y)), min(_MAX_SEEN, _PAIRS // len(outside)))
    return bool(inside(x, outside, y[seen]).any())


def _sample(numbers: Ints, limit: int) -> Ints:
    """Some of the numbers, evenly; `limit` at most, but for one."""
    return numbers[:: max(1, -(-len(numbers) // max(1, limit)))]


def _box(x: Floats) -> str:
    low, high = x.min(axis=0), x.max(axis=0)
    return ", ".join(f"{a} {low[k]:.3g} to {high[k]:.3g} m" for k, a in enumerate("xyz"))
