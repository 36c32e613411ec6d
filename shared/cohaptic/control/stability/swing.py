"""Share of an object's swing that may be shown to the hands (science 3.14).

An object with mass answers forces f with C f + W f. W = w (D - 1) w', summed over the natural
modes, is the swing of each mode about its place at rest; D is a second-order low-pass and w w' the
mode's part of C. W is 0 at rest, so that showing the swing changes no steady force. The swing adds
a loop: a hand's force sets the object swinging and comes back with the swing, a delay later. By the
small gain theorem the loop of 3.13 stays stable at any delays with a share g of W, if at every
angular frequency omega, with p = theta omega,

    F(p)^(1/2) + g h(p)^(1/2) v(omega) < (1 + (omega tau)^2)^(1/2),

where v is the norm of K^(1/2) W K^(1/2) (1 + X)^-1, F the square of the largest gain of an allowed
hand in its row of the loop, and h the square of a hand's largest gain from the swing it is shown.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from cohaptic.control.stability.anticipation import Gains, row_gain
from cohaptic.control.stability.single_contact import Floats

# Share of the largest stable g that is used. With that g itself a swing that comes back with the
# worst delay would hardly die out.
SAFETY: Final = 0.5


@dataclass(frozen=True, eq=False, slots=True)
class Swing:
    """Largest swing of an object's modes at each frequency.

    Args:
        frequency: Angular frequencies, above 0, shape (p,) [rad/s].
        size: Largest |D - 1| of any mode, shape (p,).
    """

    frequency: Floats
    size: Floats


def shown_gain(p: Floats, stiffness: float = np.inf) -> Floats:
    """Square of a hand's largest gain |H| from the swing it is shown to its force, h of 3.14.

    Args:
        p: theta times angular frequency, any shape.
        stiffness: As for `hand_factor`.

    Returns:
        Values of the shape of `p`.
    """
    if stiffness == np.inf:
        return np.asarray(1.0 + p * p)
    # (y^2 + 1) / ((x + y)^2 + 1) at y = -q, 0 <= q <= p, and x up to a: largest at x = min(a, q),
    # and beyond a at the place where its derivative vanishes.
    a = stiffness / p
    q = np.minimum(p, 0.5 * (a + np.sqrt(a * a + 4.0)))
    return np.asarray((q * q + 1.0) / ((np.minimum(a, q) - q) ** 2 + 1.0))


def worst_row_gain(gains: Gains, p: Floats, stiffness: float = np.inf) -> Floats:
    """Square of the largest gain of any hand in its row of the loop, F of 3.14.

    `row_gain` is the gain of the heaviest hand. A lighter hand, or one with a spring of its own,
    may have a larger gain if K is limited. In 3.13 `row_gain` suffices: it covers such a hand at a
    lower frequency, where the lag reduces the loop's gain less.

    Args:
        gains: Gains of the loop.
        p: theta times angular frequency, any shape.
        stiffness: As for `hand_factor`.

    Returns:
        Values of the shape of `p`.
    """
    heaviest = row_gain(gains, p)
    if stiffness == np.inf:
        return heaviest
    alpha, beta, c = gains.apart, gains.together, gains.held
    # Maximise (beta^2 x^2 + (c y - alpha x)^2 + c^2) / ((x + y)^2 + 1) over y = -q, 0 <= q <= p,
    # and x up to a. The largest value over all x grows with q; if its x is not allowed, x = a.
    a = stiffness / p
    within = p * (heaviest + alpha * c) <= a * (heaviest - alpha * alpha - beta * beta)
    c2, squares = c * c, (beta * beta + alpha * alpha) * a * a + c * c
    trace = c2 * (a * a + 1.0) + squares + 2.0 * alpha * c * a * a
    det = c2 * (beta * beta * a * a + c2)
    worst = 0.5 * (trace + np.sqrt(np.maximum(0.0, trace * trace - 4.0 * det)))
    # At x = a the maximum over q is `worst` at q = a (worst + alpha c) / (worst - c^2), or is at p.
    q = np.minimum(p, a * (worst + alpha * c) / np.maximum(worst - c2, 1e-300))
    at_end = (beta * beta * a * a + (c * q + alpha * a) ** 2 + c2) / ((a - q) ** 2 + 1.0)
    return np.where(within, heaviest, np.maximum(at_end, c2))


def felt_share(
    gains: Gains, theta: float, stiffness: float, tau: float, weight: float, swing: Swing
) -> float:
    """Share g of the swing that may be shown to the hands, 0 to 1.

    Args:
        gains: Gains of the loop without the swing.
        theta: Largest mass over damping of the hands [s].
        stiffness: As for `hand_factor`.
        tau: The room's lag [s].
        weight: Largest eigenvalue of the modes' parts of the coupling, with each hand's coupling to
            itself included: sum over hands of w' K w.
        swing: Swing of the object.
    """
    p, lagged = theta * swing.frequency, tau * swing.frequency
    room = np.sqrt(1.0 + lagged * lagged) - np.sqrt(worst_row_gain(gains, p, stiffness))
    # Norm of (1 + X)^-1; it belongs to the smallest eigenvalue of S.
    most = 1.0 + gains.apart
    taken = weight * most * swing.size * np.sqrt(shown_gain(p, stiffness))
    share = float((room / np.maximum(taken, 1e-12)).min())
    return min(1.0, max(0.0, SAFETY * share))
