"""Checks and simplifies the surfaces of several parts together."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cohaptic_server.mesh.enclosed_volume import volume
from cohaptic_server.objects.fix_surface import inside
from cohaptic_server.objects.parts.parts import PartSurface, joined
from cohaptic_server.objects.surface.checks import SurfaceReport, examine
from cohaptic_server.objects.surface.simplify import simplify

_SAMPLES = 60  # vertices of a part that decide whether it lies in another one
_FEWEST = 100  # triangles that each part keeps when all parts are simplified


def examine_all(surfaces: Sequence[PartSurface]) -> SurfaceReport:
    """Check the surface of each part by itself, since parts may touch and contain each other.

    The report has the sum of the defects, the volume that the parts enclose together, and one
    component if each part is in one piece.
    """
    reports = [examine(surface.x, surface.faces) for surface in surfaces]
    if len(reports) == 1:
        return reports[0]
    x, _ = joined(surfaces)
    return SurfaceReport(
        open_edges=sum(report.open_edges for report in reports),
        nonmanifold_edges=sum(report.nonmanifold_edges for report in reports),
        intersecting=sum(max(0, report.intersecting) for report in reports),
        components=1 + sum(report.components - 1 for report in reports),
        volume=_together(surfaces),
        size=float(np.ptp(x, axis=0).max()),
    )


def _together(surfaces: Sequence[PartSurface]) -> float:
    """Total volume of the parts that lie in no other part, in cubic units of the file."""
    sizes = [abs(volume(one.x - one.x.mean(axis=0), one.faces)) for one in surfaces]
    total = 0.0
    for k, one in enumerate(surfaces):
        some = one.x[:: max(1, len(one.x) // _SAMPLES)]
        # The points move towards the part's centre, away from a surface that two parts may share.
        points = some + 0.01 * (one.x.mean(axis=0) - some)
        nested = any(
            inside(other.x, other.faces, points).mean() > 0.5
            for j, other in enumerate(surfaces)
            if (sizes[j], j) > (sizes[k], k)
        )
        total += 0.0 if nested else sizes[k]
    return total


def simplified_to(surfaces: Sequence[PartSurface], count: int) -> tuple[PartSurface, ...]:
    """Simplify all surfaces to about `count` triangles together, each by the same share."""
    total = sum(len(one.faces) for one in surfaces)
    found: list[PartSurface] = []
    for one in surfaces:
        wanted = max(_FEWEST, count * len(one.faces) // total) if len(surfaces) > 1 else count
        fewer = simplify(one.x, one.faces, wanted) if len(one.faces) > wanted else one[1:]
        found.append(PartSurface(one.name, *fewer))
    return tuple(found)
