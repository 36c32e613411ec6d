"""Random rooms of held hands, for the theorem of science 3.8."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cohaptic.control.stability.lag_choice import coupling_matrix
from cohaptic.control.stability.single_contact import Floats


@dataclass(frozen=True, eq=False)
class Room:
    """Hands held still on one object.

    Args:
        C: Compliance of all contacts, shape (n, n) [m/N].
        stiffness: Of each user, shape (1, 1) or (3, 3), never above the object's own [N/m].
        delays: Of each row of C, the same for all rows of a user, shape (n,) [s].
    """

    C: Floats
    stiffness: list[Floats]
    delays: Floats

    @property
    def coupling(self) -> Floats:
        """S of science 3.8, shape (n, n)."""
        return coupling_matrix(self.C, self.stiffness)


def draw(rng: np.random.Generator, *, equal_delays: bool = False) -> Room:
    """Two to eight users of every kind.

    Half of the objects push all contacts the same way; some are nearly singular; in a third of the
    rooms devices are softer than the object; in a sixth of them users have friction, in three axes.
    """
    users = int(rng.integers(2, 9))
    friction = users <= 5 and rng.random() < 0.3
    axes = [3 if friction and rng.random() < 0.5 else 1 for _ in range(users)]
    n = sum(axes)
    A = rng.normal(size=(n, int(rng.integers(1, 3 * n))))
    if rng.random() < 0.5:
        A = np.abs(A)
    C = A @ A.T + 10.0 ** rng.uniform(-5.0, 0.0) * np.eye(n)
    scale = 10.0 ** rng.uniform(-2.0, -1.0, n)
    C = C * np.outer(scale, scale)
    soft = rng.random() < 1.0 / 3.0
    stiffness: list[Floats] = []
    start = 0
    for size in axes:
        own = C[start : start + size, start : start + size]
        kappa = rng.uniform(0.3, 1.0) if soft else 1.0
        values, axis = np.linalg.eigh(own)
        if size == 3 and rng.random() < 0.5:
            # A device as stiff in all directions as the object in its softest one.
            stiffness.append(kappa / float(values.max()) * np.eye(3))
        else:
            # The inverse of a nearly singular matrix would be above it by its rounding.
            stiffness.append(kappa * (axis / values) @ axis.T)
        start += size
    spread = 1.0 if equal_delays else 10.0 ** rng.uniform(-1.7, 0.0)
    each = rng.uniform(spread, 1.0, users)
    longest = 10.0 ** rng.uniform(-2.0, 0.0)
    return Room(C, stiffness, longest * np.repeat(each / each.max(), axes))
