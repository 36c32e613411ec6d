"""The pressure of a fingertip on a surface, as shares of its force on vertices."""

from __future__ import annotations

from cohaptic_server.mesh.surface import SurfaceMesh
from cohaptic_server.numeric import Floats, Ints


def pressure(
    mesh: SurfaceMesh, point: Floats, radius: float, normal: Floats | None = None
) -> tuple[Ints, Floats]:
    """Vertices under a pressure round `point`, and the share of the force on each.

    The profile is that of `PressureSearch.spread`.

    Args:
        mesh: Resting surface.
        point: Centre of the pressure, shape (3,) [m].
        radius: Contact radius [m].
        normal: Outward unit normal of the finger, shape (3,), to press only the finger's side of a
            thin part; None to press all sides.

    Returns:
        Vertices (k,) and weights (k,) that sum to 1.
    """
    found = mesh.contacts
    found.frame[0] = point
    found.frame[2] = 0.0 if normal is None else normal
    found.search.press(radius)
    count = found.search.count
    return found.under[:count].copy(), found.weights[:count].copy()
