"""The unit that a file without one was probably drawn in, from the size of what is in it."""

from __future__ import annotations

from cohaptic_server.objects.auto.remedy import Remedy
from cohaptic_server.objects.surface.accept import MAX_SIZE, MIN_SIZE

_LIKELY = (0.02, 1.0)  # m; longest side of most things that are touched with a hand
_UNITS = ((1e-3, "millimetres"), (1e-2, "centimetres"))
_UNKNOWN_SIZE = 0.2  # m; what fits between two hands


def likely_scale(size: float) -> tuple[float, Remedy] | None:
    """Metres in one unit of the file, and why; None where metres will do.

    Args:
        size: Longest side of the object's bounding box, in units of the file.
    """
    low, high = _LIKELY
    # A file of single precision may round a size at the limit.
    if (1.0 - 1e-6) * MIN_SIZE <= size <= high:
        return None
    problem = f"in metres the object would be {size:.3g} m long"
    if size > MAX_SIZE:
        for scale, unit in _UNITS:
            if low <= scale * size <= high:
                remedy = f"taken to be in {unit}, {1e3 * scale * size:.3g} mm long"
                return scale, Remedy(problem, remedy, f"--scale {scale:g}")
    # A short number, so that who reads the option can write it.
    scale = float(f"{_UNKNOWN_SIZE / size:.2g}")
    possible = high < size <= MAX_SIZE
    if possible:
        problem += ", more than a hand reaches"
    remedy = f"made {1e3 * scale * size:.3g} mm long"
    return scale, Remedy(problem, remedy, f"--scale {scale:g}", needed=not possible)
