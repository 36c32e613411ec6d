"""Anticipation: the body gets the forces that hands are about to feel (science 3.13).

A sample's force answers a surface that was made from older forces of all other hands. The server
knows those forces, since a sample names its patch, and it knows C and every K. The server therefore
takes a step of Newton's method instead of waiting for several round trips between the hands. S of
`lag_choice` is split by its eigenvalues, S = X + R. Let f be the forces of the newest samples. User
i's sample answers a patch that was made at a time t_i, when the body carried the forces u(t_i).
Then the body gets

    f* = (1 + X)^-1 (f + x),    x_i = sum_j X_ij u_j(t_i),

after the room's lag tau. X has all of the positive part of S and a share 1 / (1 + kappa) of the
negative part. Then, for every body, number of hands and constant delays T_i,

* hands held still are stable without a lag: the remaining loop has a gain of `Gains.held` < 1;
* hands of any stiffness, and of a mass up to theta times their damping, are stable with a lag
  tau >= `hand_factor` theta; if every K is small compared with damping / theta, that factor is 0.

`docs/science.md` has the proof.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from cohaptic.control.stability.lag_choice import FULL_BUDGET
from cohaptic.control.stability.single_contact import Floats

# Largest gain of the loop for a hand that offers no resistance; at 1 the hand would drift, and
# close to 1 the lag that moving hands need grows.
SOFTEST: Final = 0.9
# Least kappa: ratio of the part of the negative eigenvalues that is left to the loop to the part
# that is anticipated. With 1 (half of them), rooms whose coupling is nearly 1 need 1.5 times the
# lag for a sixth fewer round trips, and an error of C counts 2 times instead of 1.5 times.
LEAST_KAPPA: Final = 2.0
# Largest modulus of a negative eigenvalue of S that is used; at 1 the body would not give way at
# all to that combination of forces.
LARGEST: Final = 0.999
# A heavy hand, held loosely. theta is the hand's mass over its damping plus the damping that its
# device adds where the loop generates energy (3.4). This theta does not cover hands of 0.3 to
# 1.5 N s/m on devices that add no damping: of 2,000 such rooms 1 swings; 6 swing with 3 N s/m here,
# and 15 with 4.
HAND_MASS: Final = 0.5  # kg
HAND_DAMPING: Final = 2.0  # N s/m
FREQUENCIES: Final = np.geomspace(1e-2, 1e2, 401)  # theta times angular frequency


@dataclass(frozen=True, slots=True)
class Gains:
    """Gains of the loop that anticipation leaves, along the eigenvectors of S.

    Args:
        together: beta = m_+ / (1 + m_+), where m_+ is the largest eigenvalue of S.
        apart: alpha = m_- / (1 + kappa - m_-), where -m_- is the smallest eigenvalue of S.
        kappa: Ratio of the part left to the loop to the anticipated part, for negative eigenvalues.
    """

    together: float
    apart: float
    kappa: float

    @property
    def held(self) -> float:
        """Share of a force error that is left after one round trip if hands are held still."""
        return self.kappa * self.apart

    @property
    def limp(self) -> float:
        """Share of a force error that is left after one round trip if hands offer no resistance."""
        return float(np.hypot(self.together, self.apart))


UNCOUPLED: Final = Gains(0.0, 0.0, LEAST_KAPPA)


@dataclass(frozen=True, eq=False, slots=True)
class Part:
    """The anticipated part of a coupling matrix S, and properties of S and of the remaining loop.

    Args:
        X: Anticipated part of S, symmetric, shape (n, n).
        solve: (1 + X)^-1, shape (n, n).
        gains: Gains of the remaining loop.
        radius: m, the spectral radius of S.
        lowest: Smallest eigenvalue of S; below -1 no delay is stable.
    """

    X: Floats
    solve: Floats
    gains: Gains
    radius: float
    lowest: float


def gains_left(largest: float, smallest: float) -> Gains:
    """Gains of the loop that anticipation leaves, from the ends of the spectrum of S.

    Args:
        largest: Largest eigenvalue of S.
        smallest: Smallest eigenvalue of S; above -1 by the theorem's conditions, and limited to at
            least -LARGEST.
    """
    positive, negative = max(0.0, largest), min(LARGEST, max(0.0, -smallest))
    together = positive / (1.0 + positive)
    # The least kappa that keeps `limp` within SOFTEST. X has at most 1 / 3 of `negative`.
    room = max(1e-6, SOFTEST * SOFTEST - together * together) ** 0.5
    kappa = max(LEAST_KAPPA, negative / room - 1.0 + negative)
    return Gains(together, negative / (1.0 + kappa - negative), kappa)


def anticipated(S: Floats, kappa: float | None = None) -> Part:
    """Split the part that is anticipated off a coupling matrix.

    Args:
        S: `lag_choice.coupling_matrix`, symmetric, shape (n, n).
        kappa: kappa of a larger room to which these contacts belong; None to compute kappa from S.
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
    """Least ratio tau / theta with which moving hands are stable (3.13).

    tau is the room's lag and theta the largest mass over damping of the hands, which may have any
    stiffness of their own.

    Args:
        gains: Gains of the loop.
        stiffness: Largest K, as K theta over the hands' least damping; dimensionless.
    """
    if gains.together == gains.apart == 0.0:
        return 0.0  # no hands couple; the computation took a fifth of an empty room's tick
    worst = (row_gain(gains, FREQUENCIES, stiffness) - 1.0) / (FREQUENCIES * FREQUENCIES)
    return float(np.sqrt(max(0.0, float(worst.max()))))


def row_gain(gains: Gains, p: Floats, stiffness: float = np.inf) -> Floats:
    """Square of the largest gain that a hand can give to its own row of the loop, F of 3.13.

    Args:
        gains: Gains of the loop.
        p: theta times angular frequency, any shape.
        stiffness: As for `hand_factor`.

    Returns:
        Values of the shape of `p`.
    """
    alpha, beta, c = gains.apart, gains.together, gains.held
    p2 = p * p
    # The largest quotient (beta^2 x^2 + (c p + alpha x)^2 + c^2) / ((x - p)^2 + 1) over all x.
    trace = (1.0 + p2) * (alpha * alpha + beta * beta + c * c) + 2.0 * alpha * c * p2
    det = c * c * (beta * beta * (1.0 + p2) + alpha * alpha)
    worst = 0.5 * (trace + np.sqrt(np.maximum(0.0, trace * trace - 4.0 * det)))
    if stiffness == np.inf:
        return np.asarray(worst)
    # The maximum lies at x = p (worst + alpha c) / (worst - alpha^2 - beta^2). If K does not allow
    # that x, the quotient is largest at one of the ends, x = 0 or x = stiffness / p.
    largest = stiffness / p
    within = p * (worst + alpha * c) <= largest * (worst - alpha * alpha - beta * beta)
    at_end = (beta * beta + alpha * alpha) * largest * largest + 2.0 * alpha * c * stiffness
    at_end = (at_end + c * c * (1.0 + p2)) / ((largest - p) ** 2 + 1.0)
    return np.where(within, worst, np.maximum(at_end, c * c))


def hand_class(damping_budget: float, stiffest: float) -> tuple[float, float]:
    """theta of the hands of a room [s], and the argument `stiffness` of `hand_factor`.

    Args:
        damping_budget: Damping budget of the room's weakest device, Colgate's bound [N s/m].
        stiffest: Largest K of a hand, in any direction [N/m].
    """
    damping = HAND_DAMPING + min(FULL_BUDGET, max(0.0, damping_budget))
    theta = HAND_MASS / damping
    return theta, stiffest * theta / damping


def lag_of_hands(gains: Gains, damping_budget: float, stiffest: float = np.inf) -> float:
    """Lag tau that moving hands need if forces are anticipated [s].

    Args:
        gains: Gains of the loop that anticipation leaves.
        damping_budget: Damping budget of the room's weakest device, Colgate's bound [N s/m].
        stiffest: Largest K of a hand, in any direction [N/m].
    """
    theta, stiffness = hand_class(damping_budget, stiffest)
    return theta * hand_factor(gains, stiffness)
