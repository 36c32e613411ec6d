"""Which part of a room's coupling the next tick anticipates (science 3.13)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cohaptic.control.stability.anticipation import UNCOUPLED, Gains, anticipated
from cohaptic.control.stability.lag_choice import coupling_radius
from cohaptic_server.numeric import Floats
from cohaptic_server.world.lags.anticipated import NOTHING, Anticipation
from cohaptic_server.world.lags.room_loop import RoomLoop
from cohaptic_server.world.lags.turning import LONGEST_TURN
from cohaptic_server.world.loads import contact_axes

# By which the smallest eigenvalue of two hands on a rigid plate, -1, may be missed.
ROUNDING = 1e-6

# s for which no contact has been steep before forces are anticipated. Each change of the room's way
# moves contacts a little, and one that moves to and fro across the limit would be kept swinging.
CALM_TIME = LONGEST_TURN


class Planned(NamedTuple):
    """What a tick finds for the next.

    Args:
        anticipation: Of those who touch.
        gains: Of what it leaves of the room's loop; None where nothing is anticipated.
        m: Spectral radius of the coupling.
    """

    anticipation: Anticipation
    gains: Gains | None
    m: float


def find_anticipation(loop: RoomLoop, normals: Floats, calm: bool) -> Planned:
    """The anticipation of a room in the next tick.

    The paper's laws answer the dent of their own force too, and a contact that others turn answers
    along the surface (science 3.12). Neither is in S. Where there is one of them nothing is
    anticipated, and the room has the lag of science 3.8.

    Args:
        loop: That the hands close.
        normals: Of their contacts, shape (n, 3).
        calm: Whether nobody's contact has been steep for `CALM_TIME`.
    """
    if not len(loop.S):
        return Planned(NOTHING, UNCOUPLED, 0.0)
    if loop.papers or not calm:
        return Planned(NOTHING, None, coupling_radius(loop.S))
    whole = anticipated(loop.S)
    if whole.lowest < -1.0 - ROUNDING:  # gains of a user's own choice: nothing is proved
        return Planned(NOTHING, None, whole.radius)
    # Gains are those of all who may touch; only who does answers.
    ticks = np.array([user.touch.tick for user in loop.users])
    here = np.flatnonzero((loop.nearness >= 1.0) & (ticks > 0))
    if len(here) < 2:
        return Planned(NOTHING, whole.gains, whole.radius)
    sizes = np.array([span.stop - span.start for span in loop.spans])
    part, owner = whole, np.repeat(np.arange(len(here)), sizes[here])
    if len(here) < len(sizes):
        rows = np.flatnonzero(np.isin(np.repeat(np.arange(len(sizes)), sizes), here))
        part = anticipated(loop.S[np.ix_(rows, rows)], whole.gains.kappa)
    users = [loop.users[i].touch.user for i in here.tolist()]
    if len(owner) == len(here):  # nobody has friction: one direction each
        axes = normals[here]
        root = np.sqrt(np.array([loop.stiffness[i][0, 0] for i in here.tolist()]))
        ratio = root[:, None] / root
        of, to = part.X * ratio, part.solve * ratio
    else:
        axes = np.empty((len(owner), 3))
        root, inverse = np.zeros_like(part.X), np.zeros_like(part.X)
        for k, i in enumerate(here.tolist()):
            own = owner == k
            axes[own] = contact_axes(normals[i])[: sizes[i]]
            block = np.ix_(own, own)
            root[block] = np.linalg.cholesky(loop.stiffness[i])
            inverse[block] = np.linalg.inv(root[block])
        of, to = root @ part.X @ inverse, root @ part.solve @ inverse
    plan = Anticipation(np.array(users), owner, axes, of, to)
    return Planned(plan, whole.gains, whole.radius)
