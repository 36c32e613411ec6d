"""A file becomes checked tetrahedra; what is wrong with it becomes a sentence."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from cohaptic.errors import BodyError, SettingError
from cohaptic_server.bodies.solid.shape import SolidSettings
from cohaptic_server.mesh.tetrahedra import TetMesh
from cohaptic_server.numeric import Floats, Ints
from cohaptic_server.objects.surface.checks import SurfaceReport, examine, facing_outwards
from cohaptic_server.objects.surface.simplify import count_triangles, simplified
from cohaptic_server.objects.surface.surface_file import SURFACES, read_surface
from cohaptic_server.objects.tetrahedralise import ENVELOPE, fill
from cohaptic_server.objects.volume_file import VOLUMES, read_volume

KINDS = SURFACES + VOLUMES
SMALLEST, LARGEST = 0.005, 5.0  # m; the longest side of the box around an object
MAX_TRIANGLES = 300_000
MAX_FACTOR = 6e9  # bytes
_FILLING = 1e-3  # s for each triangle of a surface, about
_LOST = 0.2  # of the volume that may be missing from the tetrahedra
# Factor of blocks, measured (docs/decisions/0013): bytes for so many tetrahedra of either order.
_MEASURED = {1: (393e6, 105_456), 2: (951e6, 20_250)}


@dataclass(frozen=True, slots=True)
class ObjectFile:
    """An object that somebody brings.

    Args:
        path: Of the mesh.
        fix: Rule that says what is held (`hold.py`).
        scale: Metres in one unit of the file.
        edge: Length of an edge of a tetrahedron wanted, as a share of the diagonal of the box.
        repair: Whether an open or tangled surface is closed and untangled as fTetWild sees fit.
        material: What it is made of.
        fix_mesh: Closed surface, of the same scale; what lies in it is held.
        simplify: Triangles that the surface is brought down to first; 0 leaves it as it is.
    """

    path: Path
    fix: str = ""
    scale: float = 1.0
    edge: float = 0.05
    repair: bool = False
    material: SolidSettings = field(default_factory=SolidSettings)
    fix_mesh: Path | None = None
    simplify: int = 0

    def __post_init__(self) -> None:
        if not 1e-9 <= self.scale <= 1e9:
            raise SettingError("--scale", self.scale, "from 1e-9 to 1e9 metres in a unit")
        if not 0.005 <= self.edge <= 0.5:
            raise SettingError("--edge", self.edge, "from 0.005 to 0.5 of the object's diagonal")
        if self.simplify != 0 and not 100 <= self.simplify <= MAX_TRIANGLES:
            raise SettingError("--simplify", self.simplify, f"0, or from 100 to {MAX_TRIANGLES:,}")


@dataclass(frozen=True, eq=False)
class Prepared:
    """What came of a file.

    Args:
        tets: The object [m].
        surface: What was found of its surface; None for a volume mesh.
        triangles: Of the surface in the file.
        simplified: Triangles that were left of them; 0 if all were.
    """

    tets: TetMesh
    surface: SurfaceReport | None
    triangles: int = 0
    simplified: int = 0


def prepare(wanted: ObjectFile) -> Prepared:
    """Read, check and fill.

    Raises:
        BodyError: The file is no object that can be touched.
    """
    path = wanted.path
    kind = path.suffix.lower()
    if kind not in KINDS:
        raise BodyError(
            f"{path}: files of kind {kind or '(none)'} are not read; these are: {' '.join(KINDS)}"
        )
    if not path.is_file():
        raise BodyError(f"{path}: there is no such file")
    if not path.stat().st_size:
        raise BodyError(f"{path}: the file is empty")
    if kind in VOLUMES:
        x, cells = read_volume(path)
        _check_cost(path, len(cells), wanted.material.order, "")
        _check_size(path, x[np.unique(cells)] * wanted.scale, wanted.scale)
        return Prepared(_named(path, x * wanted.scale, cells), None)
    if not wanted.simplify:
        _check_count(path, count_triangles(path))  # before minutes go into reading millions
    x, faces = read_surface(path)
    count, left = len(faces), 0
    _check_size(path, x * wanted.scale, wanted.scale)
    if wanted.simplify and count > wanted.simplify:
        x, faces = simplified(x, faces, wanted.simplify)
        left = len(faces)
    _check_count(path, len(faces))
    report = examine(x, faces)
    _check_surface(path, report, wanted.repair)
    tets = fill(x * wanted.scale, facing_outwards(x, faces), wanted.edge)
    _check_kept(path, tets, report, wanted)
    larger = f"a larger --edge than {wanted.edge:g}"
    _check_cost(path, len(tets.tets), wanted.material.order, larger)
    return Prepared(tets, report, count, left)


def factor_bytes(tets: int, order: int) -> float:
    """Memory that the factor of a compact object will need, about; it grows as n^(4/3)."""
    measured, count = _MEASURED[order]
    return float(measured * (tets / count) ** (4.0 / 3.0))


def _check_cost(path: Path, tets: int, order: int, advice: str) -> None:
    needed = factor_bytes(tets, order)
    if needed <= MAX_FACTOR:
        return
    ways = [advice] if advice else []
    if order == 2:
        ways.append("--order 1")
    raise BodyError(
        f"{path}: {tets:,} tetrahedra of order {order} need about {needed / 1e9:.3g} GB; the limit"
        f" is {MAX_FACTOR / 1e9:g} GB. Take {' or '.join(ways or ['a coarser mesh'])}"
    )


def _check_count(path: Path, count: int) -> None:
    if count <= MAX_TRIANGLES:
        return
    hours = count * _FILLING / 3600.0
    raise BodyError(
        f"{path}: {count:,} triangles; the limit is {MAX_TRIANGLES:,}, and filling so many would"
        f" take about {hours:.2g} hours. Let them be simplified with --simplify 20000: an object"
        " for touching needs a few tens of thousands"
    )


def _check_kept(path: Path, tets: TetMesh, report: SurfaceReport, wanted: ObjectFile) -> None:
    """Refuse tetrahedra that have lost a part of what was to be filled."""
    was = abs(report.volume) * wanted.scale**3
    if wanted.repair or tets.volume >= (1.0 - _LOST) * was:
        return
    raise BodyError(
        f"{path}: the tetrahedra have {tets.volume / was:.0%} of the volume that the surface"
        f" encloses: parts thinner than about {2.0 * ENVELOPE:.1%} of the object are lost. Thicken"
        " them, or take what there is with --repair"
    )


def _named(path: Path, x: Floats, tets: Ints) -> TetMesh:
    try:
        return TetMesh.checked(x, tets)
    except BodyError as error:
        raise BodyError(f"{path}: {error}") from error


def _check_size(path: Path, x: Floats, scale: float) -> None:
    """Refuse what is no size for a hand, with the scale that was probably meant."""
    size = float(np.ptp(x, axis=0).max())
    if SMALLEST <= size <= LARGEST:
        return
    likely = [f"--scale {scale * s:g}" for s in (1e-3, 1e-2, 1e3) if 0.02 <= size * s <= 1.0]
    advice = " or ".join(likely) or "--scale with the metres in one unit of the file"
    raise BodyError(
        f"{path}: the object is {size:.4g} m long; it must be from {SMALLEST:g} to {LARGEST:g} m."
        f" Is the file in other units? Try {advice}"
    )


def _check_surface(path: Path, report: SurfaceReport, repair: bool) -> None:
    if report.flat:
        raise BodyError(f"{path}: the surface encloses no volume ({report.volume:.3g})")
    problems = report.problems()
    if problems and not repair:
        raise BodyError(
            f"{path}: {'; '.join(problems)}. Mend it, or let it be closed and untangled with"
            " --repair"
        )
    if report.pieces > 1 and not repair:
        raise BodyError(
            f"{path}: the surface is in {report.pieces} pieces; it must be one. A hollow object"
            " needs --repair"
        )
