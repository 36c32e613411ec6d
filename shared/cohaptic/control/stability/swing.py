"""How much of an object's swing hands may be shown (science 3.14).

An object with mass answers forces with C f + W f, where W = w (D - 1) w' over its natural modes is
the swing of each about its place at rest, D a second-order low-pass and w w' a mode's part of C. W
is 0 at rest, so what is shown of it changes no steady force. It adds a loop of its own: a hand's
force sets the object swinging, and comes back with the swing, a delay later. By the small gain
theorem the loop of 3.13 stays stable at any delays with a share g of W, if

    F(p)^(1/2) + g h(p)^(1/2) v(w) < (1 + (w tau)^2)^(1/2)    at every frequency w, p = theta w,

where v is the norm of W (1 + X)^-1 over K^(1/2), F the gain of a hand in its row, and h that of a
hand towards what it is shown.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from cohaptic.control.stability.anticipation import Gains, row_gain
from cohaptic.control.stability.single_contact import Floats

# Share of that g that is used. At g itself a swing behind the worst delay would hardly end.
SAFETY: Final = 0.5


@dataclass(frozen=True, eq=False, slots=True)
class Swing:
    """How far the modes of an object swing, over frequency.

    Args:
        frequency: Angular frequencies, above 0, shape (p,) [rad/s].
        size: The largest |D - 1| of a mode, shape (p,).
    """

    frequency: Floats
    size: Floats


def shown_gain(p: Floats, stiffness: float = np.inf) -> Floats:
    """Square of the largest |H| of a hand, from what it is shown to the force on it, h of 3.14.

    Args:
        p: theta times angular frequency, any shape.
        stiffness: As for `hand_factor`.

    Returns:
        Of the shape of `p`.
    """
    if stiffness == np.inf:
        return np.asarray(1.0 + p * p)
    # (y^2 + 1) / ((x + y)^2 + 1) at y = -q, 0 <= q <= p, and x up to a: largest at x = min(a, q),
    # and beyond a at the place where its derivative vanishes.
    a = stiffness / p
    q = np.minimum(p, 0.5 * (a + np.sqrt(a * a + 4.0)))
    return np.asarray((q * q + 1.0) / ((np.minimum(a, q) - q) ** 2 + 1.0))


def felt_share(
    gains: Gains, theta: float, stiffness: float, tau: float, weight: float, swing: Swing
) -> float:
    """g, the share of the swing that hands may be shown, 0 to 1.

    Args:
        gains: Of the loop without it.
        theta: Largest mass over damping of the hands [s].
        stiffness: As for `hand_factor`.
        tau: The room's lag [s].
        weight: Largest eigenvalue of the modes' parts of the coupling, each hand with itself too:
            sum over hands of w' K w.
        swing: Of the object.
    """
    p, lagged = theta * swing.frequency, tau * swing.frequency
    room = np.sqrt(1.0 + lagged * lagged) - np.sqrt(row_gain(gains, p, stiffness))
    # Of (1 + X)^-1, whose smallest eigenvalue belongs to that of S.
    most = 1.0 + gains.apart
    taken = weight * most * swing.size * np.sqrt(shown_gain(p, stiffness))
    share = float((room / np.maximum(taken, 1e-12)).min())
    return min(1.0, max(0.0, SAFETY * share))
