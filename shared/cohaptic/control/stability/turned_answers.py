"""The lag of a room whose anticipated forces include the answers of turned contacts (3.13 d).

If others turn a contact, the anticipation includes the hand's answer (`planning.known_coupling`) as
if the contact turned with the body at once. In fact the contact turns with the surface of the
previous tick. The part of the answer that comes too late is V (1 - b(s)) V^T, with V, b and T_b of
3.13 d and |1 - b(i w)| <= w T_b. With q = |V| |V^T (1 + X)^-1| the loop of 3.13 is therefore stable
if at every frequency w, with p = theta w,

    F(p)^(1/2) + h(p)^(1/2) q T_b w < (1 + (w tau)^2)^(1/2),

with F and h of 3.14, the squares of a hand's largest gain in its row of the loop and of its largest
gain from the motion that it is shown. For hands held still (F = c^2, h = 1, c = `Gains.held`) this
is tau > q T_b / (1 - c^2)^(1/2).
"""

from __future__ import annotations

import math

import numpy as np

from cohaptic.control.stability.anticipation import (
    FREQUENCIES,
    Gains,
    hand_class,
    lag_of_hands,
)
from cohaptic.control.stability.swing import shown_gain, worst_row_gain


def lag_where_turned(gains: Gains, damping_budget: float, stiffest: float, late: float) -> float:
    """Lag tau that hands, held still or moving, need if others turn contacts [s].

    Args:
        gains: Gains of the loop that anticipation leaves.
        damping_budget: Damping budget of the room's weakest device, Colgate's bound [N s/m].
        stiffest: Largest K of a hand, in any direction, finite [N/m].
        late: q T_b, the weighted delay of the answers of turned contacts [s].
    """
    theta, stiffness = hand_class(damping_budget, stiffest)
    frequency = FREQUENCIES / theta
    row = np.sqrt(worst_row_gain(gains, FREQUENCIES, stiffness))
    row = row + np.sqrt(shown_gain(FREQUENCIES, stiffness)) * late * frequency
    moving = float(((row * row - 1.0) / (frequency * frequency)).max())
    held = late / math.sqrt(1.0 - gains.held * gains.held)
    return max(lag_of_hands(gains, damping_budget, stiffest), math.sqrt(max(0.0, moving)), held)
