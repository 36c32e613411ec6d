"""How much of the swing of a body with mass is shown to the hands that touch it (science 3.14)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cohaptic.control.stability.anticipation import Gains, hand_class
from cohaptic.control.stability.swing import felt_fraction
from cohaptic_server.bodies.body import Response, Swings
from cohaptic_server.numeric import Floats
from cohaptic_server.world.lags.room_loop import Hand, hand_stiffness, takes_part

# Rates at which the felt share of the swing may rise and fall [1/s]. A change of the share moves
# surfaces under fingers, and a fall has to be complete before the hands in the room have answered.
# Reasoned, not measured.
RISE, FALL = 1.0, 10.0


def show_swing(
    body: Swings,
    response: Response,
    users: Sequence[Hand],
    near: Sequence[float],
    gains: Gains | None,
    lag: float,
    compliance: Floats,
    spans: Sequence[slice],
    starts: Sequence[int],
    dt: float,
) -> Response:
    """Choose the share of the body's swing that hands feel in the next tick.

    The swing is the deviation of the body's natural modes from their static amplitudes.

    Args:
        body: The object, which has mass.
        response: Response of this tick.
        users: Users with their newest samples and measured delays.
        near: Weight of each user as a neighbour, 0 to 1.
        gains: Gains of the loop that anticipation leaves; None if the coupling cannot be
            anticipated, and the share is 0. The share is also 0 if a near hand has a law of
            the paper: it answers its own dent a delay later, and may have no gain for a swing.
        lag: Lag of the room [s].
        compliance: Compliance between the loads of the loop, shape (loads, loads) [m/N].
        spans: Span of each user's loads in `compliance`.
        starts: First load of each user in the response.
        dt: Time since the last tick [s].

    Returns:
        The response with the chosen share; the same response if it has no swing.
    """
    swinging = body.swinging(response)
    if swinging is None:
        return response
    fraction, stiffest, budget, paper_laws = 0.0, 0.0, np.inf, False
    parts = np.zeros((swinging.along.shape[1],) * 2)
    for user, weight, span, start in zip(users, near, spans, starts, strict=False):
        if weight <= 0.0 or not takes_part(user):
            continue
        budget = min(budget, user.touch.who.damping_budget)
        paper_laws = paper_laws or user.touch.who.law.answers_own_dent
        K = hand_stiffness(user, compliance[span, span])
        stiffest = max(stiffest, float(np.abs(K).sum(axis=1).max()))
        along = swinging.along[start : start + len(K)]
        parts += along.T @ K @ along
    if gains is not None and not paper_laws:
        theta, stiffness = hand_class(budget, stiffest)
        taken = float(np.linalg.eigvalsh(parts)[-1])
        fraction = felt_fraction(gains, theta, stiffness, lag, taken, body.swing)
    before = swinging.felt
    return swinging.showing(min(before + RISE * dt, max(before - FALL * dt, fraction)))
