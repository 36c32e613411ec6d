"""What the world keeps of its forces to anticipate the next ones, as values (science 3.13)."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from cohaptic_server.numeric import Floats, Ints


@dataclass(frozen=True, eq=False, slots=True)
class Carried:
    """What the body carried in one tick.

    Args:
        tick: Its number.
        users: Numbers of the users, shape (n,).
        forces: On the hands, normal and tangential together, shape (n, 3) [N].
    """

    tick: int
    users: Ints
    forces: Floats

    def of(self, users: Ints) -> Floats:
        """Forces of some users, none of who was not there, shape (k, 3) [N]."""
        if np.array_equal(users, self.users):
            return self.forces
        rows = {user: i for i, user in enumerate(self.users.tolist())}
        found = np.array([rows.get(user, -1) for user in users.tolist()], dtype=np.int64)
        return np.concatenate([self.forces, np.zeros((1, 3))])[found]


@dataclass(frozen=True, eq=False, slots=True)
class Anticipation:
    """Which part of a room's coupling the next tick anticipates.

    Args:
        users: Numbers of those who take part, shape (k,).
        owner: Of each of their loads, the position in `users`, shape (l,).
        axes: Direction of each load on the hand, shape (l, 3).
        part: X, the change of each load's force for the others' [N/N], shape (l, l).
        solve: (1 + X)^-1, shape (l, l).
    """

    users: Ints = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    owner: Ints = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    axes: Floats = field(default_factory=lambda: np.zeros((0, 3)))
    part: Floats = field(default_factory=lambda: np.zeros((0, 0)))
    solve: Floats = field(default_factory=lambda: np.zeros((0, 0)))


NOTHING = Anticipation()
