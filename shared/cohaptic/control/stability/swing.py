"""Choose the fraction of an object's vibration that its hands may feel (science 3.14).

An object with mass answers forces f with C f + W f. Here C is the compliance, and the swing
W = w (D - 1) w', summed over the natural modes, is the vibration of each mode about its rest
position; D is a second-order low-pass and w w' the mode's part of C. W is 0 at rest, so that a hand
that feels W has the same steady force. The swing adds a loop: a hand's force makes the object
vibrate and comes back with that vibration, a delay later. If hands feel the fraction g of W, the
loop of 3.13 stays stable at any delays by the small gain theorem if, at every angular frequency
omega and with p = theta omega,

    F(p)^(1/2) + g h(p)^(1/2) v(omega) < (1 + (omega tau)^2)^(1/2),

where v is the norm of K^(1/2) W K^(1/2) (1 + X)^-1 for the hands' stiffness K and the anticipated
part X of the coupling matrix, F is the square of the largest gain of any allowed hand in its row of
the loop (`anticipation.row_gain`), h is the square of a hand's largest gain from the swing that it
feels to its force, tau is the room's lag and theta the largest mass over damping of the hands.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from cohaptic.control.stability.anticipation import Gains, row_gain
from cohaptic.control.stability.single_contact import Floats

# Ratio of the fraction g in use to the largest stable g. With the largest g itself a vibration that
# comes back with the worst delay would hardly decay. The half is reasoned, not measured.
SAFETY: Final = 0.5


@dataclass(frozen=True, eq=False, slots=True)
class Swing:
    """Largest vibration of an object's natural modes at each frequency.

    Args:
        frequency: Angular frequencies, above 0, shape (p,) [rad/s].
        size: Largest |D - 1| of all modes, with the low-pass D of a mode (3.14), shape (p,).
    """

    frequency: Floats
    size: Floats


def shown_gain(p: Floats, stiffness: float = np.inf) -> Floats:
    """Return h(p) of 3.14, the square of a hand's largest gain from swing to force.

    Args:
        p: theta times angular frequency, any shape.
        stiffness: As for `hand_factor`.

    Returns:
        Values of the shape of `p`.
    """
    if stiffness == np.inf:
        return np.asarray(1.0 + p * p)  # (3.14) h at y = -p, x = p
    # (3.14) h(p) = max of (y^2 + 1) / ((x + y)^2 + 1) over y >= -p, 0 <= x <= chi / p; y = -q
    # (3.14) at x = q, or at x = a = chi / p if q > a, up to q = (a + (a^2 + 4)^(1/2)) / 2
    a = stiffness / p
    q = np.minimum(p, 0.5 * (a + np.sqrt(a * a + 4.0)))
    return np.asarray((q * q + 1.0) / ((np.minimum(a, q) - q) ** 2 + 1.0))


def worst_row_gain(gains: Gains, p: Floats, stiffness: float = np.inf) -> Floats:
    """Return F(p) of 3.14, the square of the largest gain that any hand can give to its row.

    `row_gain` is the gain of the heaviest hand. A lighter hand, or one with a spring of its own,
    may have a larger gain if the stiffness K is limited. In 3.13 `row_gain` suffices: it covers
    such a hand at a lower frequency, where the lag reduces the loop's gain less.

    Args:
        gains: Gains of the loop that remains with anticipation.
        p: theta times angular frequency, any shape.
        stiffness: As for `hand_factor`.

    Returns:
        Values of the shape of `p`.
    """
    heaviest = row_gain(gains, p)
    if stiffness == np.inf:
        return heaviest
    alpha, beta, c = gains.apart, gains.together, gains.held
    # (3.14) F = max of (beta^2 x^2 + (c y - alpha x)^2 + c^2) / ((x + y)^2 + 1) over y = -q, q <= p
    # and 0 <= x <= a = chi / p. The largest value over all x grows with q; if its x is not allowed,
    # x = a. There it is the larger root of F^2 - `trace` F + `det` = 0, now with q as the unknown.
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


def felt_fraction(
    gains: Gains, theta: float, stiffness: float, tau: float, weight: float, swing: Swing
) -> float:
    """Return the fraction g of the object's swing that the hands may feel, 0 to 1.

    Args:
        gains: Gains of the loop that remains with anticipation, without the swing.
        theta: Largest mass over damping of the hands [s].
        stiffness: As for `hand_factor`.
        tau: Lag of the room [s].
        weight: Largest eigenvalue of the sum over all hands of w' K w, where w has the amplitude of
            each mode at the hand, shape (axes, modes), and K is the hand's stiffness.
        swing: Vibration of the object's modes.
    """
    p, lagged = theta * swing.frequency, tau * swing.frequency
    # (3.14) F(p)^(1/2) + g h(p)^(1/2) v(w) < (1 + (w tau)^2)^(1/2), solved for g at each w:
    # `room` is the right side less F^(1/2), and `taken` is h^(1/2) v
    room = np.sqrt(1.0 + lagged * lagged) - np.sqrt(worst_row_gain(gains, p, stiffness))
    # (3.14) v(w) = |K^(1/2) W K^(1/2)| (1 + alpha), at most weight max_k |D_k - 1| (1 + alpha)
    limit = 1.0 + gains.apart
    taken = weight * limit * swing.size * np.sqrt(shown_gain(p, stiffness))
    fraction = float((room / np.maximum(taken, 1e-12)).min())
    return min(1.0, max(0.0, SAFETY * fraction))
