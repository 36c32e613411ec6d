"""Examines an uploaded file: finds its problems, proposes a held region, and makes a preview."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from cohaptic.errors import BodyError, SettingError
from cohaptic.protocol.rest_mesh import MAX_VERTICES, RestMesh
from cohaptic.protocol.upload_messages import MAX_FINDINGS, Examined, Finding
from cohaptic_server.numeric import Floats, Ints, vec3
from cohaptic_server.objects.auto.resolve import find_problems, read_outside
from cohaptic_server.objects.object_file import ObjectFile
from cohaptic_server.objects.parts.parts import joined
from cohaptic_server.objects.surface.accept import MAX_SIZE, MIN_SIZE
from cohaptic_server.objects.surface.checks import facing_outwards
from cohaptic_server.objects.surface.simplify import count_triangles, simplify
from cohaptic_uploads.limits import SIZE

_LONGEST = 600  # characters of a sentence about a problem or its remedy
_MAX_TRIANGLES = 1_000_000  # in a file; examining five million took 2.5 GB and half a minute


@dataclass(frozen=True, eq=False)
class Preview:
    """Findings and surface that a visitor sees before the object is prepared.

    Args:
        examined: Findings, proposed held region and proposed unit.
        surface: Surface about the middle of its bounding box, scaled by the proposed unit [m].
        extent: Longest side of the bounding box [units of the file].
    """

    examined: Examined
    surface: RestMesh
    extent: float

    def check_scale(self, scale: float) -> None:
        """Check the size of the object for a unit of length.

        Args:
            scale: Length of one unit of the file [m].

        Raises:
            SettingError: The object would be too small or too large to be touched.
        """
        size = scale * self.extent
        # A file of single precision may round a size at the limit.
        if not (1.0 - 1e-6) * MIN_SIZE <= size <= (1.0 + 1e-6) * MAX_SIZE:
            limit = f"from {1e3 * MIN_SIZE:g} mm to {MAX_SIZE:g} m"
            raise SettingError(SIZE, f"{size:.3g} m", limit)


def examine(path: Path, triangles: int) -> Preview:
    """Examine a file, with the default options of an object.

    Args:
        path: Path of a file of one of the `KINDS`.
        triangles: Approximate largest number of triangles in the preview.

    Raises:
        BodyError: The file cannot be read, or its object cannot be touched with any options.
    """
    declared = count_triangles(path)
    if declared > _MAX_TRIANGLES:
        raise BodyError(
            f"{path}: {declared:,} triangles; the limit of an upload is {_MAX_TRIANGLES:,}."
            " Simplify it first"
        )
    source = ObjectFile(path)
    found = find_problems(source)
    x, faces = joined(read_outside(found.source))
    count = len(faces)
    low, high = x.min(axis=0), x.max(axis=0)
    extent = float((high - low).max())
    # The page shows the object about its middle, as the server will serve it.
    middle = 0.5 * (low + high)
    x = (x - middle) * found.source.scale
    findings = [
        Finding(problem=one.problem[:_LONGEST], remedy=one.remedy[:_LONGEST])
        for one in found.remedies
    ]
    examined = Examined(
        findings=tuple(findings[:MAX_FINDINGS]),
        fix=found.source.fix,
        scale=found.source.scale,
        triangles=count,
        middle=vec3(middle * found.source.scale),
    )
    return Preview(examined, _shown(x, faces, triangles), extent)


def _shown(x: Floats, faces: Ints, triangles: int) -> RestMesh:
    """Make the surface of a preview, simplified to about `triangles` triangles if it has more."""
    faces = facing_outwards(x, faces)
    if len(faces) > triangles:
        x, faces = simplify(x, faces, triangles)
    used, renamed = np.unique(faces, return_inverse=True)
    if len(used) > MAX_VERTICES or not len(faces):
        raise BodyError(
            f"its surface cannot be shown: simplified to {triangles:,} triangles it has"
            f" {len(faces):,}"
        )
    points = x[used].tolist()
    corners = renamed.reshape(-1, 3).tolist()
    return RestMesh(tuple((a, b, c) for a, b, c in points), tuple((a, b, c) for a, b, c in corners))
