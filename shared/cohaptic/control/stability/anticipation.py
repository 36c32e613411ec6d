"""Anticipation: the body gets the forces that hands are about to feel (science 3.13).

A sample's force answers a surface that was made from older forces of all others. The server knows
which, since a sample names its patch, and it knows C and every K. So it need not wait until forces
and surfaces have gone round between the hands several times: it takes the step of Newton's method.
S of `lag_choice` is split by its eigenvalues, S = X + R. With the forces f of the newest samples,
and u(t_i), those that the body carried when the patch was made that user i's sample answers,

    f* = (1 + X)^-1 (f + x),    x_i = sum_j X_ij u_j(t_i),

is what the body gets, behind the room's lag tau. X has all of the positive part of S and a share
1 / (1 + kappa) of the negative one. Then, for every body, number of hands and constant delays T_i,

* hands held still are stable without a lag: the loop that is left has a gain of `Gains.held` < 1;
* hands of any stiffness, and of a mass up to theta times their damping, are stable behind
  tau >= `hand_factor` theta; where every K is small compared with damping / theta, that is 0.

`docs/science.md` has the proof.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from cohaptic.control.stability.lag_choice import FULL_BUDGET
from cohaptic.control.stability.single_contact import Floats

# Largest gain of the loop for a hand that gives way altogether; at 1 it would drift, and close to 1
# the lag that moving hands need grows.
SOFTEST: Final = 0.9
# Least part of the negative eigenvalues that is left to the loop, over what is anticipated of them.
# With the half of them, 1, rooms whose coupling is nearly 1 need half as much lag again for a sixth
# less of the ways round, and an error of C counts twice as much instead of half as much again.
LEAST_KAPPA: Final = 2.0
# Modulus of a negative eigenvalue of S that counts; at 1 the body would give way to nothing.
LARGEST: Final = 0.999
# A heavy hand, held loosely. theta is its mass over its damping and what its device adds where the
# loop makes energy (3.4). Of 2,000 rooms of hands of 0.3 to 1.5 N s/m on devices that add nothing,
# which no such theta covers, 1 swings; with 3 N s/m here 6 do, with 4 there are 15.
HAND_MASS: Final = 0.5  # kg
HAND_DAMPING: Final = 2.0  # N s/m
FREQUENCIES: Final = np.geomspace(1e-2, 1e2, 401)  # theta times angular frequency


@dataclass(frozen=True, slots=True)
class Gains:
    """Gains of the loop that anticipation leaves, along the eigenvectors of S.

    Args:
        together: beta = m_+ / (1 + m_+), of the largest eigenvalue of S, m_+.
        apart: alpha = m_- / (1 + kappa - m_-), of the smallest one, -m_-.
        kappa: kappa of the negative part, what is left to the loop over what is anticipated.
    """

    together: float
    apart: float
    kappa: float

    @property
    def held(self) -> float:
        """Share of an error that is left after one way round, of hands held still."""
        return self.kappa * self.apart

    @property
    def limp(self) -> float:
        """The same of hands that give way altogether."""
        return float(np.hypot(self.together, self.apart))


UNCOUPLED: Final = Gains(0.0, 0.0, LEAST_KAPPA)


@dataclass(frozen=True, eq=False, slots=True)
class Part:
    """The part of a coupling that is anticipated.

    Args:
        X: Symmetric, shape (n, n).
        solve: (1 + X)^-1, shape (n, n).
        gains: Gains of the loop that is left.
        radius: m, the spectral radius of S.
        lowest: Smallest eigenvalue of S; below -1 no delay is stable.
    """

    X: Floats
    solve: Floats
    gains: Gains
    radius: float
    lowest: float


def gains_left(largest: float, smallest: float) -> Gains:
    """The gains of a room, by the ends of the spectrum of S.

    Args:
        largest: Eigenvalue of S.
        smallest: Eigenvalue of S; above -1 by the theorem's conditions, and cut to `LARGEST`.
    """
    positive, negative = max(0.0, largest), min(LARGEST, max(0.0, -smallest))
    together = positive / (1.0 + positive)
    # As much as keeps `limp` within SOFTEST, and no more than a third.
    room = max(1e-6, SOFTEST * SOFTEST - together * together) ** 0.5
    kappa = max(LEAST_KAPPA, negative / room - 1.0 + negative)
    return Gains(together, negative / (1.0 + kappa - negative), kappa)


def anticipated(S: Floats, kappa: float | None = None) -> Part:
    """The part of a coupling that is anticipated.

    Args:
        S: `lag_choice.coupling_matrix`, symmetric, shape (n, n).
        kappa: kappa of a larger room that this one is a part of; None for its own.
    """
    values, vectors = np.linalg.eigh(S)
    gains = gains_left(float(values[-1]), float(values[0]))
    share = 1.0 / (1.0 + (gains.kappa if kappa is None else kappa))
    part = np.maximum(values, share * np.maximum(values, -LARGEST))
    return Part(
        (vectors * part) @ vectors.T,
        (vectors / (1.0 + part)) @ vectors.T,
        gains,
        float(max(-values[0], values[-1])),
        float(values[0]),
    )


def hand_factor(gains: Gains, stiffness: float = np.inf) -> float:
    """Least tau over theta with which moving hands are stable, whatever their own stiffness (3.13).

    theta is the largest mass over damping of the hands.

    Args:
        gains: Gains of the loop.
        stiffness: The stiffest K, as K theta over the hands' least damping; without
            unit.
    """
    if gains.together == gains.apart == 0.0:
        return 0.0  # of nobody, or of one alone; to find it took a fifth of an empty room's tick
    worst = (row_gain(gains, FREQUENCIES, stiffness) - 1.0) / (FREQUENCIES * FREQUENCIES)
    return float(np.sqrt(max(0.0, float(worst.max()))))


def row_gain(gains: Gains, p: Floats, stiffness: float = np.inf) -> Floats:
    """Square of the largest gain that a hand gives its row of the loop, F of 3.13.

    Args:
        gains: Gains of the loop.
        p: theta times angular frequency, any shape.
        stiffness: As for `hand_factor`.

    Returns:
        Values of the shape of `p`.
    """
    alpha, beta, c = gains.apart, gains.together, gains.held
    p2 = p * p
    # The largest quotient (beta^2 x^2 + (c p + alpha x)^2 + c^2) / ((x - p)^2 + 1) over x, ...
    trace = (1.0 + p2) * (alpha * alpha + beta * beta + c * c) + 2.0 * alpha * c * p2
    det = c * c * (beta * beta * (1.0 + p2) + alpha * alpha)
    worst = 0.5 * (trace + np.sqrt(np.maximum(0.0, trace * trace - 4.0 * det)))
    if stiffness == np.inf:
        return np.asarray(worst)
    # ... which is at x = p (worst + alpha c) / (worst - alpha^2 - beta^2). Where K allows no
    # such x, the quotient is largest at one of the ends, x = 0 and stiffness / p.
    largest = stiffness / p
    within = p * (worst + alpha * c) <= largest * (worst - alpha * alpha - beta * beta)
    at_end = (beta * beta + alpha * alpha) * largest * largest + 2.0 * alpha * c * stiffness
    at_end = (at_end + c * c * (1.0 + p2)) / ((largest - p) ** 2 + 1.0)
    return np.where(within, worst, np.maximum(at_end, c * c))


def hand_class(damping_budget: float, stiffest: float) -> tuple[float, float]:
    """theta of the hands of a room [s], and the stiffness of `hand_factor`.

    Args:
        damping_budget: Damping budget of the room's weakest device, Colgate's bound [N s/m].
        stiffest: Largest K of a hand, in any direction [N/m].
    """
    damping = HAND_DAMPING + min(FULL_BUDGET, max(0.0, damping_budget))
    theta = HAND_MASS / damping
    return theta, stiffest * theta / damping


def lag_of_hands(gains: Gains, damping_budget: float, stiffest: float = np.inf) -> float:
    """tau that moving hands need where forces are anticipated [s].

    Args:
        gains: Gains of what anticipation leaves of the loop.
        damping_budget: Damping budget of the room's weakest device, Colgate's bound [N s/m].
        stiffest: Largest K of a hand, in any direction [N/m].
    """
    theta, stiffness = hand_class(damping_budget, stiffest)
    return theta * hand_factor(gains, stiffness)
