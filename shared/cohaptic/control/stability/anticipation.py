"""Anticipation: the server applies the forces that hands are about to feel (science 3.13).

A sample's force answers a surface that was made from older forces of all other hands. The server
knows those forces, since a sample names its patch, and it knows the compliance matrix C and the
stiffness K of every hand. The server therefore takes a step of Newton's method instead of waiting
for several round trips between the hands. The coupling matrix S of `lag_choice` is split by its
eigenvalues, S = X + R. Let f be the forces of the newest samples. User i's sample answers a patch
that was made at a time t_i, when the body carried the forces u(t_i). Then the server applies

    f* = (1 + X)^-1 (f + x),    x_i = sum_j X_ij u_j(t_i),

to the body, after the room's lag tau. X has the positive part of S and the fraction 1 / (1 + kappa)
of its negative part. Then, for every body, number of hands and constant loop delays T_i,

* hands held still are stable without a lag: the remaining loop has a gain of `Gains.held` < 1;
* hands of any stiffness, and of a mass up to theta times their damping, are stable with a lag
  tau >= `hand_factor` times theta; that factor is 0 if every K is small compared with the damping
  over theta.

`docs/science.md` has the proof.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from cohaptic.control.stability.lag_choice import FULL_BUDGET
from cohaptic.control.stability.single_contact import Floats

# Largest gain of the loop for a hand that offers no resistance; at 1 the hand would drift, and the
# nearer the gain comes to 1, the longer is the lag that moving hands need (science 3.13). Reasoned,
# not measured.
SOFTEST: Final = 0.9
# Least kappa. Each negative eigenvalue of S has a part that the server anticipates, and a part
# kappa times as large that stays in the loop. With kappa = 1, rooms whose coupling is nearly 1 need
# 1.5 times the lag for a sixth fewer round trips, and an error of C counts 2 instead of 1.5 times.
# docs/performance.md has rooms with several values.
LEAST_KAPPA: Final = 2.0
# Limit for the modulus of negative eigenvalues of S; at 1 the body would not give way at all to the
# combination of forces in the eigenvector. Reasoned, not measured: a thousandth is less than what
# is known of S.
LARGEST: Final = 0.999
# A heavy, relaxed hand. theta is the hand's mass, divided by the sum of its damping and the damping
# that its device adds where the loop generates energy (3.4). This theta does not cover hands of 0.3
# to 1.5 N s/m on devices that add no damping: of 2,000 such rooms 1 oscillates; 6 oscillate with
# 3 N s/m here, and 15 with 4.
HAND_MASS: Final = 0.5  # kg
HAND_DAMPING: Final = 2.0  # N s/m
# theta times angular frequency: two decades on either side of 1, where a hand turns from a damper
# into a mass, and a hundred values in each, 2.3 % apart.
FREQUENCIES: Final = np.geomspace(1e-2, 1e2, 401)


@dataclass(frozen=True, slots=True)
class Gains:
    """Gains of the delayed loop between hands that remains with anticipation (science 3.13).

    Args:
        together: beta = m_+ / (1 + m_+), where m_+ is the largest eigenvalue of the matrix S.
        apart: alpha = m_- / (1 + kappa - m_-), where -m_- is the smallest eigenvalue of S.
        kappa: For negative eigenvalues, the ratio of the part that stays in the loop to the part
            that the server anticipates.
    """

    together: float
    apart: float
    kappa: float

    @property
    def held(self) -> float:
        """Factor by which one round trip multiplies a force error if hands are held still."""
        return self.kappa * self.apart

    @property
    def limp(self) -> float:
        """Factor by which one round trip multiplies a force error if hands do not resist."""
        return float(np.hypot(self.together, self.apart))


UNCOUPLED: Final = Gains(0.0, 0.0, LEAST_KAPPA)


@dataclass(frozen=True, eq=False, slots=True)
class Part:
    """The part X of a coupling matrix S that the server anticipates, and the gains that remain.

    Args:
        X: Anticipated part of S, symmetric, shape (n, n).
        solve: Inverse (1 + X)^-1, shape (n, n).
        gains: Gains of the loop that remains.
        radius: Spectral radius m of S.
        lowest: Smallest eigenvalue of S; below -1 the room is unstable at every delay.
    """

    X: Floats
    solve: Floats
    gains: Gains
    radius: float
    lowest: float


def gains_left(largest: float, smallest: float) -> Gains:
    """Compute the gains that remain with anticipation, from the extreme eigenvalues of S.

    Args:
        largest: Largest eigenvalue of the coupling matrix S.
        smallest: Smallest eigenvalue of S; above -1 by the theorem's conditions, and treated as
            -LARGEST if it is less.
    """
    # (3.13) m_+ = positive, m_- = negative
    positive, negative = max(0.0, largest), min(LARGEST, max(0.0, -smallest))
    together = positive / (1.0 + positive)  # (3.13) beta = m_+ / (1 + m_+)
    # The least kappa that keeps `limp` within SOFTEST. X has at most 1 / 3 of `negative`.
    room = max(1e-6, SOFTEST * SOFTEST - together * together) ** 0.5
    kappa = max(LEAST_KAPPA, negative / room - 1.0 + negative)
    # (3.13) alpha = m_- / (1 + kappa - m_-), c = kappa alpha = `Gains.held`
    return Gains(together, negative / (1.0 + kappa - negative), kappa)


def anticipated(S: Floats, kappa: float | None = None) -> Part:
    """Compute the part X of a coupling matrix S that the server anticipates.

    Args:
        S: Coupling matrix, symmetric, shape (n, n) (`lag_choice.coupling_matrix`).
        kappa: `Gains.kappa` of a larger room to which the contacts of S belong; None to compute
            kappa from S. It changes X, but not the gains in the result.
    """
    values, vectors = np.linalg.eigh(S)
    gains = gains_left(float(values[-1]), float(values[0]))
    fraction = 1.0 / (1.0 + (gains.kappa if kappa is None else kappa))
    # (3.13) S = X + R, X = lambda where lambda >= 0, lambda / (1 + kappa) where lambda < 0
    part = np.maximum(values, fraction * np.maximum(values, -LARGEST))
    return Part(
        (vectors * part) @ vectors.T,
        (vectors / (1.0 + part)) @ vectors.T,  # (3.13) (1 + X)^-1
        gains,
        float(max(-values[0], values[-1])),
        float(values[0]),
    )


def hand_factor(gains: Gains, stiffness: float = np.inf) -> float:
    """Return the least ratio of the room's lag to theta with which moving hands are stable (3.13).

    theta is the largest ratio of mass to damping of the hands, which may have any stiffness of
    their own.

    Args:
        gains: Gains of the loop that remains with anticipation.
        stiffness: Largest stiffness K that a client renders, as K theta over the hands' least
            damping; dimensionless.
    """
    if gains.together == gains.apart == 0.0:
        return 0.0  # no hands couple; the computation took a fifth of an empty room's tick
    # (3.13) r^2 = max of (F(p) - 1) / p^2 over p > 0; F_chi(p) for F(p) with chi = stiffness (c)
    worst = (row_gain(gains, FREQUENCIES, stiffness) - 1.0) / (FREQUENCIES * FREQUENCIES)
    return float(np.sqrt(max(0.0, float(worst.max()))))


def row_gain(gains: Gains, p: Floats, stiffness: float = np.inf) -> Floats:
    """Return F(p) of 3.13, the square of the largest gain that a hand can give to its row.

    Row i of the loop gives the force of hand i in answer to the forces of all hands.

    Args:
        gains: Gains of the loop that remains with anticipation.
        p: theta times angular frequency, any shape.
        stiffness: As for `hand_factor`.

    Returns:
        Values of the shape of `p`.
    """
    alpha, beta, c = gains.apart, gains.together, gains.held
    p2 = p * p
    # (3.13) (beta^2 x^2 + (c y - alpha x)^2 + c^2) / ((x + y)^2 + 1) at y = -p, largest over all x:
    # (3.13) F^2 - t F + q = 0, its larger root; t = trace, q = det, F = worst
    # (3.13) t = (1 + p^2) (alpha^2 + beta^2 + c^2) + 2 alpha c p^2
    trace = (1.0 + p2) * (alpha * alpha + beta * beta + c * c) + 2.0 * alpha * c * p2
    # (3.13) q = c^2 (beta^2 (1 + p^2) + alpha^2)
    det = c * c * (beta * beta * (1.0 + p2) + alpha * alpha)
    worst = 0.5 * (trace + np.sqrt(np.maximum(0.0, trace * trace - 4.0 * det)))
    if stiffness == np.inf:
        return np.asarray(worst)
    # (3.13 c) F lies at x = p (F + alpha c) / (F - alpha^2 - beta^2). If x <= chi / p forbids that,
    # F_chi is the quotient at one of the ends: c^2 at x = 0, `at_end` at x = chi / p.
    largest = stiffness / p
    within = p * (worst + alpha * c) <= largest * (worst - alpha * alpha - beta * beta)
    at_end = (beta * beta + alpha * alpha) * largest * largest + 2.0 * alpha * c * stiffness
    at_end = (at_end + c * c * (1.0 + p2)) / ((largest - p) ** 2 + 1.0)
    return np.where(within, worst, np.maximum(at_end, c * c))


def hand_class(damping_budget: float, stiffest: float) -> tuple[float, float]:
    """Return theta of the hands in a room [s], and the argument `stiffness` of `hand_factor`.

    Args:
        damping_budget: Least damping budget of the room's devices, Colgate's bound [N s/m].
        stiffest: Largest stiffness K that a client renders, in any direction [N/m].
    """
    damping = HAND_DAMPING + min(FULL_BUDGET, max(0.0, damping_budget))
    # (3.13) theta = M / b; (3.13 c) K <= chi b / theta
    theta = HAND_MASS / damping
    return theta, stiffest * theta / damping


def lag_of_hands(gains: Gains, damping_budget: float, stiffest: float = np.inf) -> float:
    """Return the lag tau that moving hands need if the server anticipates forces [s].

    Args:
        gains: Gains of the loop that remains with anticipation.
        damping_budget: Least damping budget of the room's devices, Colgate's bound [N s/m].
        stiffest: Largest stiffness K that a client renders, in any direction [N/m].
    """
    theta, stiffness = hand_class(damping_budget, stiffest)
    return theta * hand_factor(gains, stiffness)  # (3.13) tau >= r theta
