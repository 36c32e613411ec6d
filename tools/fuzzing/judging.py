"""Reads one file up to the filling, and judges what became of it.

The reading is that of `cohaptic body inspect` and of an upload: `find_problems` reads and diagnoses
the file and proposes options, and `prepare` reads it again with these options, checks it, mends it
and would fill it. The filling takes seconds and is fTetWild's, so it is replaced by the end of the
reading. A volume mesh is not filled and passes all of `prepare`.

The judge trusts none of the product's own checks. It looks for itself whether what was accepted has
finite points in general position, triangles with an area, and a volume.
"""

from __future__ import annotations

import traceback
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np
import numpy.typing as npt

from cohaptic.errors import CohapticError
from cohaptic_server.objects import prepare as prepare_module
from cohaptic_server.objects.auto.resolve import find_problems
from cohaptic_server.objects.object_file import ObjectFile
from cohaptic_server.objects.prepare import prepare

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]

READ, REFUSED = "read", "refused"
# Faults of a reader: an exception that is no CohapticError, more memory than allowed, something
# accepted that is no solid, a refusal that does not say which file it is about, and a warning of
# numpy's about numbers that should have been refused.
TRACEBACK, MEMORY, GARBAGE, UNNAMED, WARNED = "traceback", "memory", "garbage", "unnamed", "warned"
# Faults that only a process beside sees: no end in time, and the end of the process.
HUNG, DIED = "hung", "died"
NO_VOLUME = "a tetrahedron has no volume, or is inside out"
OTHER_VOLUME = "the tetrahedra have another volume than their boundary encloses"
FAULTS = (TRACEBACK, HUNG, DIED, MEMORY, GARBAGE, UNNAMED, WARNED)

_FLAT = 1e-9  # least extent over the largest one of points in general position
_EMPTY = 1e-12  # volume over the cube of the size that is none but for rounding
_SUM = 1e-6  # relative difference of the tetrahedra's volumes from the volume in their boundary
_LONGEST = 1000  # characters of a sentence for a user


@dataclass(frozen=True, slots=True)
class Verdict:
    """What became of a file.

    Args:
        state: `READ`, `REFUSED` or one of `FAULTS`.
        words: The error's words, or those about the fault.
        where: Kind of exception, file and function; equal for equal faults.
        volume: Volume of what was read [m^3].
    """

    state: str
    words: str = ""
    where: str = ""
    volume: float = 0.0

    @property
    def bad(self) -> bool:
        """Whether it is a fault of a reader."""
        return self.state in FAULTS

    def like(self, other: Verdict) -> bool:
        """Whether it is the same fault."""
        return (self.state, self.where) == (other.state, other.where)


Judge = Callable[[Path, int], Verdict]  # its arguments are those of `judge`


class _Filled(Exception):
    """Ends the reading where the filling would begin.

    Args:
        x: Vertices of the surface to be filled, shape (n, 3) [m].
        faces: Triangles, shape (m, 3).
        outer: The same of the surface beyond which no tetrahedron is kept.
    """

    def __init__(self, x: Floats, faces: Ints, outer: tuple[Floats, Ints]) -> None:
        super().__init__()
        self.x, self.faces, self.outer = x, faces, outer


def _stop(x: Floats, faces: Ints, *_: Any, within: Any = None, **__: Any) -> None:
    raise _Filled(x, faces, within or (x, faces))


def judge(path: Path, simplify: int = 0) -> Verdict:
    """Read a file and judge the reading; raises nothing but what ends the process."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        found = _judged(path, simplify)
    numbers = [one for one in caught if issubclass(one.category, RuntimeWarning)]
    if found.bad or not numbers:
        return found
    first = numbers[0]
    return Verdict(WARNED, str(first.message), f"{Path(first.filename).name}:{first.lineno}")


def _judged(path: Path, simplify: int) -> Verdict:
    try:
        with mock.patch.object(prepare_module, "tetrahedralise", _stop):
            found = find_problems(ObjectFile(path, simplify=simplify))
            prepared = prepare(found.source)
    except _Filled as end:
        wrong = "; ".join(wrong_surface(end.x, end.faces))
        volume = abs(_enclosed(*end.outer))
    except CohapticError as error:
        said = str(error)
        good = path.name in said and len(said) <= _LONGEST and said.isprintable()
        return Verdict(REFUSED if good else UNNAMED, said, "" if good else _place(error))
    except MemoryError as error:
        return Verdict(MEMORY, str(error), _place(error))
    except Exception as error:
        return Verdict(TRACEBACK, f"{type(error).__name__}: {error}", _place(error))
    else:
        tets = prepared.tets
        wrong = "; ".join(wrong_solid(tets.vertices, tets.tets))
        volume = tets.volume
    return Verdict(GARBAGE, wrong, wrong) if wrong else Verdict(READ, volume=volume)


def _place(error: BaseException) -> str:
    """Kind of an exception, and the last place in our own code that it passed."""
    frames = traceback.extract_tb(error.__traceback__)
    ours = [frame for frame in frames if "cohaptic" in Path(frame.filename).as_posix()]
    last = (ours or frames)[-1]
    return f"{type(error).__name__} {Path(last.filename).name} {last.name}"


def _wrong_points(x: Floats, cells: Ints) -> Iterator[str]:
    if not np.isfinite(x).all():
        yield "a point is not finite"
        return
    if cells.min(initial=0) < 0 or cells.max(initial=-1) >= len(x) or not len(cells):
        yield "a cell names a point that is not there"
        return
    if len(np.unique(cells)) < len(x):
        yield "a point belongs to no cell"
    extents = np.linalg.svd(x - x.mean(axis=0), compute_uv=False)
    if len(x) < 4 or extents[2] <= _FLAT * extents[0]:
        yield "the points lie in a plane"


def wrong_surface(x: Floats, faces: Ints) -> Iterator[str]:
    """Reasons why a surface encloses no solid; none if it may."""
    wrong = list(_wrong_points(x, faces))
    yield from wrong
    if not wrong and not (_areas(x, faces) > 0.0).any():
        yield "no triangle has an area"
    if not wrong and abs(_enclosed(x, faces)) <= _EMPTY * float(np.ptp(x, axis=0).max()) ** 3:
        yield "it encloses no volume"


def _areas(x: Floats, faces: Ints) -> Floats:
    a, b, c = (x[faces[:, k]] for k in range(3))
    return np.asarray(0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1))


def _enclosed(x: Floats, faces: Ints) -> float:
    """Volume that triangles enclose, as the sum of the tetrahedra to the middle of all points."""
    return float(np.linalg.det((x - x.mean(axis=0))[faces]).sum()) / 6.0


_SIDES = ((0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2))


def wrong_solid(x: Floats, tets: Ints) -> Iterator[str]:
    """Reasons why tetrahedra, of which each should have a positive volume, make no solid."""
    wrong = list(_wrong_points(x, tets))
    yield from wrong
    if wrong:
        return
    each = np.linalg.det(x[tets[:, 1:]] - x[tets[:, :1]]) / 6.0
    if (each <= 0.0).any():
        yield NO_VOLUME
        return
    faces = tets[:, np.array(_SIDES)].reshape(-1, 3)
    _, inverse, counts = np.unique(
        np.sort(faces, axis=1), axis=0, return_inverse=True, return_counts=True
    )
    outer = faces[counts[inverse.reshape(-1)] == 1]
    if not len(outer) or abs(_enclosed(x, outer) / each.sum() - 1.0) > _SUM:
        yield OTHER_VOLUME
