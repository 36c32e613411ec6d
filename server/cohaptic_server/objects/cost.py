"""What preparing an object takes in memory and time, known before it is spent.

The memory of factoring follows from the plan of the elimination, byte by byte; its time from the
same plan and from how fast this machine multiplies. Before there are tetrahedra their number is
estimated from the volume and the area of the surface, within a factor of two on smooth ones.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from cohaptic.clock import Clock
from cohaptic.errors import BodyError
from cohaptic_server.cholesky.plan import Plan
from cohaptic_server.numeric import Floats, Ints

# Bytes of the program with its libraries, the tetrahedra and what assembling them leaves: 150 to
# 230 MB were measured.
_PROGRAM = 2.4e8
_PRESSING = 1.0e8  # bytes beside the factor while the surface is pressed: forces of 256 presses
# Tetrahedra by volume and by area over powers of the edge, fitted to an organ at edges of 0.03 to
# 0.1 of its diagonal (23,708 to 1,971), and seconds for each triangle and tetrahedron, which hold
# within 2 on a torus, a rod, and a scan of 60,000 triangles (docs/decisions/0033).
_BY_VOLUME, _BY_AREA = 1.0, 21.6
_PER_TRIANGLE, _PER_TET = 5e-4, 5e-4
# Power of the edge with which the memory falls, and how much is added to an edge for what it does
# not follow. Memory goes with the number of tetrahedra to 4/3 (George 1973), and those, most of
# which lie at a surface, with the edge to 2.1 on an organ; 2.8 was measured on crossing objects.
_GROWTH, _MARGIN = 2.75, 1.05
# Of the rate of a product of large matrices: that of a factorisation, and of presses one by one.
_FACTORING, _PRESSES = 0.35, 0.5
_SIDE, _PRODUCTS = 600, 3  # of the matrices by which the rate is measured: about 30 ms


class TooCostlyError(BodyError):
    """An object cannot be prepared within the memory that is allowed.

    Args:
        words: The error.
        needed: Memory that it takes [bytes].
    """

    def __init__(self, words: str, needed: float) -> None:
        super().__init__(words)
        self.needed = needed


@dataclass(frozen=True, slots=True)
class Cost:
    """What a part of a preparation takes.

    Args:
        memory: At its peak, the program included [bytes].
        seconds: About how long [s].
    """

    memory: float
    seconds: float

    def words(self) -> str:
        """For a bar or a line: `1.2 GB, about 30 s`."""
        return f"{self.memory / 1e9:.2g} GB, {about(self.seconds)}"


def about(seconds: float) -> str:
    """A time that is not known well, in words."""
    if seconds < 90.0:
        return f"about {max(1.0, float(f'{seconds:.1g}')):.0f} s"
    return f"about {seconds / 60.0:.0f} min"


def cost_of(plan: Plan, rate: float) -> Cost:
    """What factoring a solid, pressing on it and storing it takes.

    Args:
        plan: Plan of its elimination.
        rate: `multiplications` of this machine [1/s].
    """
    factoring = plan.matrix_bytes + plan.peak_bytes
    pressing = plan.factor_bytes + _PRESSING
    # What is stored is half as large, and made beside it and what the presses have left.
    storing = 1.5 * plan.factor_bytes + _PRESSING
    seconds = plan.operations / (_FACTORING * rate) + plan.press_operations / (_PRESSES * rate)
    return Cost(_PROGRAM + max(factoring, pressing, storing), seconds)


def edge_that_fits(edge: float, needed: float, memory: float, growth: float = _GROWTH) -> float:
    """An edge with which a solid takes less memory, as a share of the diagonal; 0.5 at most.

    Args:
        edge: With which it takes too much.
        needed: Memory with that edge [bytes].
        memory: That there is [bytes].
        growth: Power of the edge with which the memory falls.
    """
    ratio = _own(needed) / max(1e7, memory - _PROGRAM)
    return float(f"{min(0.5, _MARGIN * edge * max(1.0, ratio) ** (1.0 / growth)):.2g}")


def growth_between(edge: float, needed: float, longer: float, less: float) -> float:
    """Power of the edge with which the memory of an object falls, by two of its meshes.

    Args:
        edge: Edge of the finer one.
        needed: Memory that it takes [bytes].
        longer: Edge of the coarser one.
        less: Memory that that one takes [bytes].
    """
    measured = math.log(_own(needed) / _own(less)) / math.log(longer / edge)
    return min(4.0, max(1.0, measured))


def _own(needed: float) -> float:
    """Share of a memory that is not the program's [bytes]."""
    return max(1e6, needed - _PROGRAM)


def check_memory(cost: Cost, memory: float, what: str, edge: float | None, order: int) -> None:
    """Check that there is memory for a factorisation before it begins.

    Args:
        cost: Cost of the object.
        memory: Most that it may take [bytes].
        what: The object in words, for the error.
        edge: Edge of its elements, if another one can be taken.
        order: Order of its elements.

    Raises:
        TooCostlyError: It takes more.
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
    """About how many tetrahedra will fill a surface.

    Args:
        x: Vertices, shape (n, 3).
        faces: Triangles, shape (m, 3).
        volume: That they enclose, in cubic units of `x`.
        edge: Target edge length, as a share of the bounding box's diagonal.
    """
    length = edge * float(np.linalg.norm(np.ptp(x, axis=0)))
    a, b, c = (x[faces[:, k]] for k in range(3))
    area = 0.5 * float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum())
    return _BY_VOLUME * abs(volume) / length**3 + _BY_AREA * area / length**2


def filling_seconds(triangles: int, tetrahedra: float) -> float:
    """About how long fTetWild takes on one core [s]."""
    return _PER_TRIANGLE * triangles + _PER_TET * tetrahedra


def multiplications(clock: Clock) -> float:
    """How many multiplications and additions of a product this machine does in a second, now."""
    a = np.ones((_SIDE, _SIDE))
    np.dot(a, a)  # the first one starts BLAS
    begin = clock.now()
    for _ in range(_PRODUCTS):
        np.dot(a, a)
    return 2.0 * _PRODUCTS * _SIDE**3 / max(1e-6, clock.now() - begin)
