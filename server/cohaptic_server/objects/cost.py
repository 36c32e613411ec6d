"""Estimates the memory and time of preparing an object before the work begins.

The memory of factoring follows from the plan of the elimination, byte by byte; its time follows
from the same plan and from how fast this machine multiplies. Before filling, the number of
tetrahedra is estimated from the volume and area of the surface; the estimate is within a factor of
two if the surface is smooth.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from cohaptic.clock import Clock
from cohaptic.errors import BodyError
from cohaptic_server.cholesky.plan import Plan
from cohaptic_server.numeric import Floats, Ints

# Bytes of the program with its libraries, the tetrahedra and the memory that assembling does not
# return: 150 to 230 MB were measured.
_PROGRAM = 2.4e8
_PRESSING = 1.0e8  # bytes beside the factor while the surface is pressed: forces of 256 presses
# Tetrahedra per volume / edge^3 and per area / edge^2, fitted to an organ at edges of 0.03 to 0.1
# of its diagonal (23,708 to 1,971 of them); and seconds for each triangle and tetrahedron, within a
# factor of 2 on a torus, a rod, and a scan of 60,000 triangles (docs/decisions/0033).
_BY_VOLUME, _BY_AREA = 1.0, 21.6
_PER_TRIANGLE, _PER_TET = 5e-4, 5e-4
# Exponent p of the memory, which goes with edge^-p; a factor on the edge for deviations from it.
# Memory grows with the number of tetrahedra to the power 4/3 (George 1973). Most tetrahedra lie at
# a surface, and their number falls with the edge to the power 2.1 on an organ; 2.8 was measured on
# crossing objects.
_GROWTH, _MARGIN = 2.75, 1.05
# Rates of a factorisation and of presses one by one, over that of a product of large matrices.
_FACTORING, _PRESSES = 0.35, 0.5
_SIDE, _PRODUCTS = 600, 3  # side and number of products that measure the rate: about 30 ms


class TooCostlyError(BodyError):
    """An object cannot be prepared within the memory that is allowed.

    Args:
        needed: Memory that preparing the object takes [bytes].
    """

    def __init__(self, words: str, needed: float) -> None:
        super().__init__(words)
        self.needed = needed


@dataclass(frozen=True, slots=True)
class Cost:
    """Memory and time of one part of a preparation.

    Args:
        memory: Peak memory, the program included [bytes].
        seconds: Approximate time [s].
    """

    memory: float
    seconds: float

    def words(self) -> str:
        """Text for a progress bar or a line: `1.2 GB, about 30 s`."""
        return f"{self.memory / 1e9:.2g} GB, {about(self.seconds)}"


def about(seconds: float) -> str:
    """An approximate time in words, such as `about 30 s`."""
    if seconds < 90.0:
        return f"about {max(1.0, float(f'{seconds:.1g}')):.0f} s"
    return f"about {seconds / 60.0:.0f} min"


def cost_of(plan: Plan, rate: float) -> Cost:
    """Memory and time of factoring a solid, pressing on it and storing it.

    Args:
        plan: Plan of the elimination.
        rate: `multiplications` of this machine [1/s].
    """
    factoring = plan.matrix_bytes + plan.peak_bytes
    pressing = plan.factor_bytes + _PRESSING
    # The stored factor is half as large. The copy is made while the factor and the memory of the
    # presses are still held.
    storing = 1.5 * plan.factor_bytes + _PRESSING
    seconds = plan.operations / (_FACTORING * rate) + plan.press_operations / (_PRESSES * rate)
    return Cost(_PROGRAM + max(factoring, pressing, storing), seconds)


def edge_that_fits(edge: float, needed: float, memory: float, growth: float = _GROWTH) -> float:
    """Edge length at which a solid fits into the memory, as a share of the diagonal, up to 0.5.

    Args:
        edge: Edge length at which the solid takes too much memory, as a share of the diagonal.
        needed: Memory that the solid takes at that edge length [bytes].
        memory: Available memory [bytes].
        growth: Exponent p of the memory, which goes with edge^-p.
    """
    ratio = _own(needed) / max(1e7, memory - _PROGRAM)
    return float(f"{min(0.5, _MARGIN * edge * max(1.0, ratio) ** (1.0 / growth)):.2g}")


def growth_between(edge: float, needed: float, longer: float, less: float) -> float:
    """Exponent p of an object's memory, which goes with edge^-p, from two of its meshes; 1 to 4.

    Args:
        edge: Edge length of the finer mesh.
        needed: Memory that the finer mesh takes [bytes].
        longer: Edge length of the coarser mesh.
        less: Memory that the coarser mesh takes [bytes].
    """
    measured = math.log(_own(needed) / _own(less)) / math.log(longer / edge)
    return min(4.0, max(1.0, measured))


def _own(needed: float) -> float:
    """Needed memory without that of the program itself, at least 1 MB [bytes]."""
    return max(1e6, needed - _PROGRAM)


def check_memory(cost: Cost, memory: float, what: str, edge: float | None, order: int) -> None:
    """Check, before a factorisation begins, that it fits into the memory limit.

    Args:
        memory: Limit of the memory [bytes].
        what: The object in words, for the error.
        edge: Edge length of the elements; None if it cannot be changed.
        order: Order of the elements.

    Raises:
        TooCostlyError: Preparing the object takes more memory.
    """
    if cost.memory <= memory:
        return
    ways: list[str] = []
    if edge is not None and (fits := edge_that_fits(edge, cost.memory, memory)) > edge:
        ways.append(f"--edge {fits:g}")
    if order == 2:
        ways.append("--order 1")
    ways.append(f"--max-memory {1.05 * cost.memory / 1e9:.2g}")
    raise TooCostlyError(
        f"{what} would take {cost.memory / 1e9:.3g} GB to prepare; the limit is"
        f" {memory / 1e9:.3g} GB. Take {' or '.join(ways)}",
        cost.memory,
    )


def tetrahedra_expected(x: Floats, faces: Ints, volume: float, edge: float) -> float:
    """Estimate the number of tetrahedra that will fill a surface.

    Args:
        x: Vertices, shape (n, 3).
        faces: Triangles, shape (m, 3).
        volume: Volume that the triangles enclose, in cubic units of `x`.
        edge: Target edge length, as a share of the bounding box's diagonal.
    """
    length = edge * float(np.linalg.norm(np.ptp(x, axis=0)))
    a, b, c = (x[faces[:, k]] for k in range(3))
    area = 0.5 * float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum())
    return _BY_VOLUME * abs(volume) / length**3 + _BY_AREA * area / length**2


def filling_seconds(triangles: int, tetrahedra: float) -> float:
    """Estimate the time that fTetWild takes on one core [s]."""
    return _PER_TRIANGLE * triangles + _PER_TET * tetrahedra


def multiplications(clock: Clock) -> float:
    """Measure the multiplications and additions per second in a matrix product now [1/s]."""
    a = np.ones((_SIDE, _SIDE))
    np.dot(a, a)  # the first one starts BLAS
    begin = clock.now()
    for _ in range(_PRODUCTS):
        np.dot(a, a)
    return 2.0 * _PRODUCTS * _SIDE**3 / max(1e-6, clock.now() - begin)
