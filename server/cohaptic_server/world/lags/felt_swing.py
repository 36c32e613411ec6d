"""Share of an object's swing that a room shows to its hands (science 3.14)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cohaptic.control.stability.anticipation import Gains, hand_class
from cohaptic.control.stability.swing import felt_share
from cohaptic_server.bodies.body import Response, Swings
from cohaptic_server.numeric import Floats
from cohaptic_server.world.lags.room_loop import RoomLoop, hand_stiffness

# Rates at which the share may rise and fall [1/s]. A change of the share moves surfaces under
# fingers, and a fall has to be complete before the room has answered.
_RISE, _FALL = 1.0, 10.0


def show_swing(
    body: Swings,
    response: Response,
    loop: RoomLoop,
    gains: Gains | None,
    lag: float,
    compliance: Floats,
    spans: Sequence[slice],
    starts: Sequence[int],
    dt: float,
) -> Response:
    """Return the response, set to the share of its swing that the next tick shows to hands.

    Args:
        body: The object, which has mass.
        response: Response of this tick; a response without a swing is returned as it is.
        gains: Gains of the loop that anticipation leaves; None if the coupling cannot be
            anticipated, and the share is 0. The share is also 0 for a hand alone with a law of the
            paper: the law answers its own dent a delay later, and may have no gain left for a
            swing.
        lag: Lag of the room [s].
        compliance: Compliance between the loads of the loop, shape (loads, loads) [m/N].
        spans: Rows of each user in `compliance`.
        starts: First load of each user in the response.
        dt: Simulation period N T [s].
    """
    swinging = body.swinging(response)
    if swinging is None:
        return response
    share, stiffest = 0.0, 0.0
    parts = np.zeros((swinging.along.shape[1],) * 2)
    for i, (user, span, start) in enumerate(zip(loop.users, spans, starts, strict=False)):
        if loop.nearness[i] <= 0.0:
            continue
        K = hand_stiffness(user, compliance[span, span])
        stiffest = max(stiffest, float(np.abs(K).sum(axis=1).max()))
        along = swinging.along[start : start + len(K)]
        parts += along.T @ K @ along
    if gains is not None and not loop.papers:
        theta, stiffness = hand_class(loop.damping_budget, stiffest)
        weight = float(np.linalg.eigvalsh(parts)[-1])
        share = felt_share(gains, theta, stiffness, lag, weight, body.swing)
    before = swinging.felt
    return swinging.showing(min(before + _RISE * dt, max(before - _FALL * dt, share)))
