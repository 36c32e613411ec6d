"""Users and tick rate for which an object is prepared, and the number of nodes that these allow.

The time of a linear solid's tick is O(contacts) and not O(mesh): the period limits the number of
users, and a coarser mesh does not help. A nonlinear solid is factored in every tick, which limits
the size of its mesh.
"""

from __future__ import annotations

from dataclasses import dataclass

from cohaptic.errors import SettingError
from cohaptic_server.bodies.rubber_solid.rubber_solid import tick_seconds

MAX_USERS = 64
MIN_HZ, MAX_HZ = 10.0, 200.0
# Share of a period that the median tick of a linear solid may take: the rest is for the network and
# for slow ticks. The sixteen users of a room at 60 Hz are within it.
SHARE_OF_PERIOD = 0.65
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
        return self.period if self.nonlinear else SHARE_OF_PERIOD * self.period

    def check(self) -> None:
        """Check, before meshing, that a tick with the coarsest mesh is short enough for the rate.

        Raises:
            SettingError: Even the coarsest mesh takes too long.
        """
        if self.affords(_FEWEST_NODES):
            return
        others = (Demand(n, self.hz, self.nonlinear) for n in range(MAX_USERS, 0, -1))
        most = next((other.users for other in others if other.affords(_FEWEST_NODES)), 0)
        tick = self.expected_tick(_FEWEST_NODES)
        words = f"at most {most} at {self.hz:g} Hz" if most else f"a rate below {self.hz:g} Hz"
        raise SettingError(
            "--users",
            self.users,
            f"{words}: even the coarsest mesh would take about {1e3 * tick:.2g} ms in each tick,"
            f" and there are {1e3 * self._allowed:.2g} ms",
        )
