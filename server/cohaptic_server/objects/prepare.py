"""A mesh file becomes checked tetrahedra: read, check, fill. Every error is one sentence."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from cohaptic.errors import BodyError
from cohaptic_server.mesh.nearest import nearest_point
from cohaptic_server.mesh.surface import SurfaceMesh
from cohaptic_server.mesh.tetrahedra import TetMesh, boundary
from cohaptic_server.numeric import Floats, Ints
from cohaptic_server.objects.cost import about, filling_seconds, tetrahedra_expected
from cohaptic_server.objects.fill_process import FillLimitError
from cohaptic_server.objects.object_file import MAX_TRIANGLES, ObjectFile
from cohaptic_server.objects.surface.checks import SurfaceReport, examine, facing_outwards
from cohaptic_server.objects.surface.shell import in_one_sense, thicken
from cohaptic_server.objects.surface.simplify import count_triangles, simplify
from cohaptic_server.objects.surface.surface_file import SURFACES, read_surface
from cohaptic_server.objects.tetrahedralise import ENVELOPE, tetrahedralise
from cohaptic_server.objects.volume_file import VOLUMES, read_volume
from cohaptic_server.progress import Progress

KINDS = SURFACES + VOLUMES
MIN_SIZE, MAX_SIZE = 0.005, 5.0  # m; longest side of an object's bounding box
_TETS_PER_TRIANGLE = 3.0  # of a surface too fine for its edge; 2.3 on a noisy scan
_DEVIATION_SAMPLES = 3000  # vertices of a surface whose distance from the tetrahedra is measured
_MAX_VOLUME_LOSS = 0.2  # share of the enclosed volume that the tetrahedra may miss


class VolumeLostError(BodyError):
    """The tetrahedra miss a part of what the surface encloses.

    Args:
        words: The error.
        share: Of the volume that they have.
    """

    def __init__(self, words: str, share: float) -> None:
        super().__init__(words)
        self.share = share


@dataclass(frozen=True, eq=False)
class Prepared:
    """The tetrahedra of a file, and the report on its surface.

    Args:
        tets: The object [m].
        surface: Report on the surface; None for a volume mesh.
        triangles: Number of triangles in the file.
        simplified: Number of triangles after simplification; 0 without any.
        deviation: Largest distance of the surface in the file from that of the tetrahedra [m].
    """

    tets: TetMesh
    surface: SurfaceReport | None
    triangles: int = 0
    simplified: int = 0
    deviation: float = 0.0


def prepare(source: ObjectFile, progress: Progress = lambda phase, share: None) -> Prepared:
    """Read a file, check it and fill its surface with tetrahedra.

    Args:
        source: The file and its options.
        progress: Called with the phase and the share of it that is done.

    Raises:
        BodyError: The file is no object that can be touched.
    """
    check_file(source.path)
    if source.path.suffix.lower() in VOLUMES:
        return _prepare_volume(source)
    return _prepare_surface(source, progress)


def _prepare_volume(source: ObjectFile) -> Prepared:
    path = source.path
    x, cells = read_volume(path)
    _check_size(path, x[np.unique(cells)] * source.scale, source.scale)
    try:
        return Prepared(TetMesh.checked(x * source.scale, cells), None)
    except BodyError as error:
        raise BodyError(f"{path}: {error}") from error


def _prepare_surface(source: ObjectFile, progress: Progress) -> Prepared:
    path = source.path
    progress("reading and checking", 0.0)
    if not source.simplify:
        _check_count(path, count_triangles(path))  # reading millions of triangles takes minutes
    x, faces = read_surface(path)
    triangles, simplified = len(faces), 0
    _check_size(path, x * source.scale, source.scale)
    if source.shell:
        x, faces = thicken(x, in_one_sense(x, faces), source.shell / source.scale)
    original = x * source.scale
    # What is said of the file is said of the file: where even the slowest way of simplifying it
    # makes crossings of its own, filling untangles them.
    report = examine(x, faces) if triangles <= MAX_TRIANGLES else None
    if source.simplify and len(faces) > source.simplify:
        progress("simplifying", 0.0)
        x, faces = simplify(x, faces, source.simplify)
        simplified = len(faces)
    _check_count(path, len(faces))
    # A file of more triangles is only known as it is after it was simplified.
    culprit = "" if report else f"after --simplify {source.simplify}, which may have made this, "
    report = report or examine(x, faces)
    _check_surface(f"{path}: {culprit}", report, source.repair)
    tets = _filled(source, x, facing_outwards(x, faces), report, progress)
    _check_volume(source, tets, report)
    return Prepared(tets, report, triangles, simplified, _farthest(original, tets))


def _filled(
    source: ObjectFile, x: Floats, faces: Ints, report: SurfaceReport, progress: Progress
) -> TetMesh:
    """The tetrahedra of a surface in units of the file, within its time and memory."""
    expected = tetrahedra_expected(x, faces, report.volume, source.edge)
    phase = f"filling, {about(filling_seconds(len(faces), expected))}"
    progress(phase, 0.0)
    try:
        return tetrahedralise(
            x * source.scale,
            faces,
            source.edge,
            largest=source.repair,
            memory=source.max_memory,
            seconds=source.max_time,
            progress=lambda share: progress(phase, share),
        )
    except FillLimitError as error:
        coarser = f"--edge {min(0.5, 1.5 * source.edge):.2g}"
        fewer = f"--simplify {max(1000, len(faces) // 4)}"
        raise FillLimitError(
            f"{source.path}: {error}. Take {fewer} or {coarser}, or raise --max-memory or"
            " --max-time"
        ) from error
    except BodyError as error:
        raise BodyError(f"{source.path}: {error}") from error


def _farthest(x: Floats, tets: TetMesh) -> float:
    """Largest distance of some points from the surface of the tetrahedra [m].

    Args:
        x: Points, shape (n, 3) [m]; if there are many, a part of them is taken.
        tets: The tetrahedra.
    """
    faces = boundary(tets.tets)
    used, renamed = np.unique(faces, return_inverse=True)
    mesh = SurfaceMesh(tets.vertices[used], renamed.reshape(-1, 3))
    taken = x[:: max(1, len(x) // _DEVIATION_SAMPLES)]
    return max(float(np.linalg.norm(nearest_point(mesh, p) - p)) for p in taken)


def check_file(path: Path) -> None:
    """Check that a file is there, and of a kind that is read.

    Raises:
        BodyError: It is not.
    """
    kind = path.suffix.lower()
    if kind not in KINDS:
        raise BodyError(
            f"{path}: files of kind {kind or '(none)'} are not read; these are: {' '.join(KINDS)}"
        )
    if not path.is_file():
        raise BodyError(f"{path}: there is no such file")
    if not path.stat().st_size:
        raise BodyError(f"{path}: the file is empty")


def _check_count(path: Path, count: int) -> None:
    if count <= MAX_TRIANGLES:
        return
    hours = filling_seconds(count, _TETS_PER_TRIANGLE * count) / 3600.0
    raise BodyError(
        f"{path}: {count:,} triangles; the limit is {MAX_TRIANGLES:,}, and filling so many would"
        f" take about {hours:.2g} hours. Let them be simplified with --simplify 20000: an object"
        " for touching needs a few tens of thousands"
    )


def _check_volume(source: ObjectFile, tets: TetMesh, report: SurfaceReport) -> None:
    """Refuse tetrahedra that miss a part of the enclosed volume."""
    enclosed = abs(report.volume) * source.scale**3
    if source.repair or tets.volume >= (1.0 - _MAX_VOLUME_LOSS) * enclosed:
        return
    share = tets.volume / enclosed
    raise VolumeLostError(
        f"{source.path}: the tetrahedra have {share:.0%} of the volume that the"
        f" surface encloses: parts thinner than about {2.0 * ENVELOPE:.1%} of the object are lost."
        " Thicken them, or take what there is with --repair",
        share,
    )


def _check_size(path: Path, x: Floats, scale: float) -> None:
    """Refuse an object too small or too large to touch; name the scale that was probably meant."""
    size = float(np.ptp(x, axis=0).max())
    # A file of single precision may round a size at the limit.
    if (1.0 - 1e-6) * MIN_SIZE <= size <= (1.0 + 1e-6) * MAX_SIZE:
        return
    likely = [f"--scale {scale * s:g}" for s in (1e-3, 1e-2, 1e3) if 0.02 <= size * s <= 1.0]
    advice = " or ".join(likely) or "--scale with the metres in one unit of the file"
    raise BodyError(
        f"{path}: the object is {size:.4g} m long; it must be from {MIN_SIZE:g} to {MAX_SIZE:g} m."
        f" Is the file in other units? Try {advice}"
    )


def _check_surface(of: str, report: SurfaceReport, repair: bool) -> None:
    if report.flat:
        raise BodyError(f"{of}the surface encloses no volume ({report.volume:.3g})")
    problems = report.problems()
    if problems and not repair:
        raise BodyError(
            f"{of}{'; '.join(problems)}. Mend it, or let it be closed and untangled with --repair"
        )
    if report.components > 1 and not repair:
        raise BodyError(
            f"{of}the surface is in {report.components} pieces; it must be one. A hollow object"
            " needs --repair"
        )
