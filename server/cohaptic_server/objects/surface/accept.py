"""Refuses surfaces and tetrahedra that make no object for touching."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from cohaptic.errors import BodyError
from cohaptic_server.mesh.surface import SurfaceMesh
from cohaptic_server.mesh.tetrahedra import TetMesh, boundary
from cohaptic_server.numeric import Floats, Ints
from cohaptic_server.objects.cost import filling_seconds
from cohaptic_server.objects.object_file import MAX_TRIANGLES, ObjectFile
from cohaptic_server.objects.parts.parts import MAX_AWAY, MAX_VOLUME_LOSS, VolumeLostError
from cohaptic_server.objects.surface.checks import SurfaceReport
from cohaptic_server.objects.tetrahedralise import ENVELOPE, envelope

MIN_SIZE, MAX_SIZE = 0.005, 5.0  # m; longest side of an object's bounding box
_TETS_PER_TRIANGLE = 3.0  # if triangles are shorter than the edge; 2.3 on a noisy scan
_DEVIATION_SAMPLES = 3000  # vertices of a surface whose distance from the tetrahedra is measured


def check_count(path: Path, count: int) -> None:
    """Refuse a surface with more triangles than can be filled."""
    if count <= MAX_TRIANGLES:
        return
    hours = filling_seconds(count, _TETS_PER_TRIANGLE * count) / 3600.0
    raise BodyError(
        f"{path}: {count:,} triangles; the limit is {MAX_TRIANGLES:,}, and filling so many would"
        f" take about {hours:.2g} hours. Let them be simplified with --simplify 20000: an object"
        " for touching needs a few tens of thousands"
    )


def check_volume(source: ObjectFile, tets: TetMesh, report: SurfaceReport) -> None:
    """Without --repair, refuse tetrahedra that miss over `MAX_VOLUME_LOSS` of the volume."""
    enclosed = abs(report.volume) * source.scale**3
    if source.repair or tets.volume >= (1.0 - MAX_VOLUME_LOSS) * enclosed:
        return
    raise VolumeLostError(
        f"the tetrahedra have {tets.volume / enclosed:.0%} of the volume that the surface encloses",
        f": parts thinner than about {2.0 * ENVELOPE:.1%} of the object are lost."
        " Thicken them, or take what there is with --repair",
        path=source.path,
    )


def check_deviation(source: ObjectFile, size: float, deviation: float) -> None:
    """Refuse tetrahedra that end far from some of the surface, unless --repair is given.

    Args:
        size: Diagonal of the surface's bounding box [m].
        deviation: Largest distance from the surface to that of the tetrahedra [m].
    """
    if source.repair or deviation <= (envelope(source.edge) + MAX_AWAY) * size:
        return
    raise VolumeLostError(
        f"the tetrahedra end {1e3 * deviation:.2g} mm from a part of the surface",
        ": it is too thin for elements of this size. Take a smaller --edge, or what there is with"
        " --repair",
        path=source.path,
    )


def check_size(path: Path, x: Floats, scale: float) -> None:
    """Refuse an object too small or too large to touch; the error suggests a scale."""
    size = float(np.ptp(x, axis=0).max())
    # A file in single precision may round a size at the limit.
    if (1.0 - 1e-6) * MIN_SIZE <= size <= (1.0 + 1e-6) * MAX_SIZE:
        return
    likely = [f"--scale {scale * s:g}" for s in (1e-3, 1e-2, 1e3) if 0.02 <= size * s <= 1.0]
    advice = " or ".join(likely) or "--scale with the metres in one unit of the file"
    raise BodyError(
        f"{path}: the object is {size:.4g} m long; it must be from {MIN_SIZE:g} to {MAX_SIZE:g} m."
        f" Is the file in other units? Try {advice}"
    )


def check_surface(of: str, report: SurfaceReport, *, repair: bool) -> None:
    """Refuse a surface without volume; without --repair also one with defects or several pieces."""
    check_not_flat(of, report)
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


def check_not_flat(of: str, report: SurfaceReport) -> None:
    """Refuse a surface that encloses no volume, as one does whose points lie in a plane."""
    if report.flat:
        raise BodyError(
            f"{of}the surface encloses no volume ({report.volume:.3g} cubic units of the file)."
            " Export a solid, or give a sheet a thickness with --shell"
        )


def farthest(points: Floats, x: Floats, tets: Ints) -> float:
    """Largest distance from some points to the surface of tetrahedra [m].

    Args:
        points: Points, shape (n, 3) [m]; of many points only a sample is used.
        x: Vertices, shape (k, 3) [m].
        tets: Vertices of each tetrahedron, shape (m, 4).
    """
    used, renamed = np.unique(boundary(tets), return_inverse=True)
    mesh = SurfaceMesh(x[used], renamed.reshape(-1, 3))
    taken = points[:: max(1, len(points) // _DEVIATION_SAMPLES)]
    return max(float(np.linalg.norm(nearest_point(mesh, p) - p)) for p in taken)


def nearest_point(mesh: SurfaceMesh, p: Floats) -> Floats:
    """Nearest point of a surface at rest to `p` (3,) [m], shape (3,) [m].

    The search covers the face of the nearest quadrature point and the neighbours of that face.
    """
    x, y, z = p.tolist()
    near = mesh.contacts.near
    near.nearest(x, y, z)
    return np.array(near.foot)
