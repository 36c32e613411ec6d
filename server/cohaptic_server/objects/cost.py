"""Estimates the cost of an object before the work begins: its preparation, and its ticks.

The memory of factoring follows from the plan of the elimination, byte by byte; its time follows
from the same plan and from how fast this machine multiplies. Before filling, the number of
tetrahedra is estimated from the volume and area of the surface; the estimate is within a factor of
two if the surface is smooth.

An object is prepared for a number of users and a tick rate, which limit its number of nodes. The
time of a linear solid's tick is O(contacts) and not O(mesh): the period limits the number of users,
and a coarser mesh does not help. A nonlinear solid is factored in every tick, which limits the size
of its mesh.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from cohaptic.clock import Clock
from cohaptic.errors import BodyError, SettingError
from cohaptic_server.bodies.rubber_solid.rubber_solid import tick_seconds
from cohaptic_server.cholesky.plan import Plan
from cohaptic_server.numeric import Floats, Ints

# Bytes of the program with its libraries, the tetrahedra and the memory that assembling does not
# return: 150 to 230 MB were measured.
_PROGRAM = 2.4e8
_PRESSING = 1.0e8  # bytes beside the factor while the surface is pressed: forces of 256 presses
# Tetrahedra per volume / edge^3 and per area / edge^2, fitted to an organ at edges of 0.03 to 0.1
# of its diagonal (23,708 to 1,971 of them); and seconds for each triangle and tetrahedron, within a
# factor of 2 on a torus, a rod, and a scan of 60,000 triangles (docs/design/objects.md).
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


MAX_USERS = 64
MIN_HZ, MAX_HZ = 10.0, 200.0
# Share of a period that the median tick of a linear solid may take: the rest is for the network and
# for slow ticks. The sixteen users of a room at 60 Hz are within it.
FRACTION_OF_PERIOD = 0.65
# Time of a tick with mesh patches, and of each user in it [s]. With hands at rest 0.2 to 0.3 ms for
# each user were measured on solids of 1,600 to 15,700 tetrahedra, independent of their number; with
# hands that slide at 0.2 m/s over 137,000 tetrahedra it was 6.0 ms for 8 users on a server
# (docs/performance.md). Each user of a nonlinear solid took 0.3 to 0.6 ms more at 900 to 3,200
# nodes.
_TICK, _USER = 0.6e-3, 0.6e-3
_IN_NODES = 2  # users in the measurement of `tick_seconds`
_FEWEST_NODES = 300  # nodes of the coarsest nonlinear solid: a torus has 541 at --edge 0.3


@dataclass(frozen=True, slots=True)
class Demand:
    """Number of users and tick rate that an object is prepared for.

    Args:
        users: Number of users who touch the object at once.
        hz: Ticks per second.
        nonlinear: Whether the object is a nonlinear solid under large deformation.

    Raises:
        SettingError: A value is out of its range.
    """

    users: int = 2
    hz: float = 60.0
    nonlinear: bool = False

    def __post_init__(self) -> None:
        if not 1 <= self.users <= MAX_USERS:
            raise SettingError("--users", self.users, f"from 1 to {MAX_USERS}")
        if not MIN_HZ <= self.hz <= MAX_HZ:
            raise SettingError("--hz", f"{self.hz:g} Hz", f"from {MIN_HZ:g} to {MAX_HZ:g}")

    @property
    def period(self) -> float:
        """Period of the simulation [s]."""
        return 1.0 / self.hz

    def affords(self, nodes: int) -> bool:
        """Whether a tick of an object with this number of nodes is short enough for the rate."""
        return self.expected_tick(nodes) <= self._allowed

    def expected_tick(self, nodes: int) -> float:
        """Expected time of a tick [s]: the median if linear, that of a slow tick if nonlinear."""
        if not self.nonlinear:
            return _TICK + _USER * self.users
        return tick_seconds(nodes) + _USER * max(0, self.users - _IN_NODES)

    @property
    def _allowed(self) -> float:
        return self.period if self.nonlinear else FRACTION_OF_PERIOD * self.period

    def check(self) -> None:
        """Check, before meshing, that a tick with the coarsest mesh is short enough for the rate.

        Raises:
            SettingError: Even the coarsest mesh takes too long.
        """
        if self.affords(_FEWEST_NODES):
            return
        others = (Demand(n, self.hz, self.nonlinear) for n in range(MAX_USERS, 0, -1))
        limit = next((other.users for other in others if other.affords(_FEWEST_NODES)), 0)
        tick = self.expected_tick(_FEWEST_NODES)
        words = f"at most {limit} at {self.hz:g} Hz" if limit else f"a rate below {self.hz:g} Hz"
        raise SettingError(
            "--users",
            self.users,
            f"{words}: even the coarsest mesh would take about {1e3 * tick:.2g} ms in each tick,"
            f" and there are {1e3 * self._allowed:.2g} ms",
        )
