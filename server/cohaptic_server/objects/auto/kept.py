"""How much of an object may be lost where nobody has said that what is left of it will do."""

from __future__ import annotations

import numpy as np

from cohaptic.errors import BodyError
from cohaptic_server.objects.object_file import ObjectFile
from cohaptic_server.objects.parts.volume_lost import VolumeLostError
from cohaptic_server.objects.prepare import Prepared

# Thin parts of an object may go, such as fingers and a rim, but not what it is: a leaflet of which
# a lump is left, or one of two halves that a thread joins.
LEAST_KEPT = 0.5  # share of the volume
MOST_AWAY = 0.2  # distance of a part of the surface from what is left, as a share of the diagonal


def check_kept(source: ObjectFile, prepared: Prepared, lost: VolumeLostError) -> None:
    """Refuse what is left of an object, where too much of it is lost to go by its name.

    Not asked of a surface that is mended first: what an open or crossing one encloses is not known,
    and the pieces of another are dropped on purpose.

    Args:
        source: The file and its options.
        prepared: What is left.
        lost: Why it is not all of it.

    Raises:
        BodyError: It is less than half, or ends too far from a part of the surface.
    """
    x = prepared.tets.vertices[np.unique(prepared.tets.tets)]
    # The object is at most as much longer than what is left of it.
    longest = float(np.linalg.norm(np.ptp(x, axis=0))) + prepared.deviation
    enclosed = 0.0 if prepared.surface is None else abs(prepared.surface.volume) * source.scale**3
    kept = min(1.0, prepared.tets.volume / enclosed) if enclosed > 0.0 else 1.0
    if kept >= LEAST_KEPT and prepared.deviation <= MOST_AWAY * longest:
        return
    raise BodyError(
        f"{source.path}: {lost.problem}, and what is left is not the object any more: {kept:.0%} of"
        f" its volume, up to {1e3 * prepared.deviation:.2g} mm from its surface. Thicken what is"
        " thin, give a sheet a thickness with --shell, or take what there is with --repair and"
        " without --auto"
    )
