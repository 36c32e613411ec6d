"""Choice of the room's lag: the time constant with which the object answers the others (3.8).

Every hand keeps the object's own stiffness, K_i = min(1 / C_ii, device). Where the coupling is so
strong that the delayed forces of several hands would amplify each other, the forces enter the body
through one first-order lag tau, the same for all: tau f~' = f - f~. The object then answers the
others' forces with some viscosity, and is never softer.

With S_ij = K_i^(1/2) C_ij K_j^(1/2) off the diagonal, m its spectral radius and T_max the longest
loop delay of the room, hands held still are stable

    without a lag for m < 1,    and else for    tau > T_max sqrt(m^2 - 1) / arccos(-1 / m).

`docs/science.md` has the proof, for unequal delays; `room_roots.py` has the exact roots. Moving
hands need more: tau >= theta m, with theta at least the mass of a hand over its damping. The
damping that a device may add reduces theta.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TypeVar

import numpy as np

from cohaptic.control.room_lag import RoomLag as RoomLag
from cohaptic.control.stability.single_contact import Floats

# Least stable lag of the theorem over the lag in use. The rest is a margin for delays that vary and
# hands that move.
SHARE = 0.7
# theta for a device that may damp nothing [s]: mass over damping of a heavy hand, 0.5 kg, 4 N s/m.
HAND_TIME = 0.12
FULL_BUDGET = 8.0  # N s/m; most that the passivity layer damps
# theta for a device with the full budget [s]: DAMPED_HAND_TIME for a coupling above the second
# value of TIGHT, 0 below the first, linear in between. Both were found with `cohaptic experiment
# hands`; two hands on opposite sides of a balloon have a coupling of 0.65 and need no lag.
DAMPED_HAND_TIME = 0.06
TIGHT = (0.7, 0.75)
EXACT = 1e-9  # coupling below which hands count as uncoupled, far above its rounding
Lag = TypeVar("Lag", float, Floats)


def coupling_matrix(C: Floats, stiffness: Sequence[Floats] | Floats) -> Floats:
    """S of science 3.8: K^(1/2) C K^(1/2) without the blocks on its diagonal.

    For a block of three axes any square root serves, since another one turns S by an orthogonal
    matrix; here it is Cholesky's.

    Args:
        C: Compliance of all contacts, user after user, shape (n, n) [m/N].
        stiffness: Stiffness of each user, symmetric and positive, shape (1, 1) or (3, 3) [N/m]; (3,
            3) with friction. Their sizes add up to n.

    Returns:
        Shape (n, n), symmetric, without a unit.

    Raises:
        numpy.linalg.LinAlgError: A (3, 3) stiffness is not positive definite.
    """
    S = np.array(C, dtype=np.float64)
    if len(stiffness) == len(S):  # hands of one axis each: the roots are numbers
        roots = np.sqrt(np.array(stiffness, dtype=np.float64).reshape(-1))
        S *= roots[:, None] * roots
        np.fill_diagonal(S, 0.0)
        return np.asarray(0.5 * (S + S.T))
    start = 0
    for K in stiffness:
        end = start + len(K)
        S[start:end, start:end] = 0.0
        root = np.asarray(np.sqrt(K) if len(K) == 1 else np.linalg.cholesky(K), dtype=np.float64)
        S[start:end] = root.T @ S[start:end]
        S[:, start:end] = S[:, start:end] @ root
        start = end
    return np.asarray(0.5 * (S + S.T))


def coupling_radius(S: Floats) -> float:
    """m, the largest modulus of an eigenvalue of S; 0 for nobody.

    Args:
        S: Symmetric, shape (n, n).
    """
    return float(np.abs(np.linalg.eigvalsh(S)).max()) if S.size else 0.0


def lag_needed(coupling: float, longest_delay: float) -> float:
    """The theorem's edge: above it every room of this coupling is stable (science 3.8) [s].

    Continuous at m = 1, where it leaves 0; exact for equal delays.

    Args:
        coupling: m.
        longest_delay: T_max, sampling and the client's ramp between patches counted [s].
    """
    if coupling <= 1.0:
        return 0.0
    return longest_delay * math.sqrt(coupling * coupling - 1.0) / math.acos(-1.0 / coupling)


def hand_time(damping_budget: float, coupling: float) -> float:
    """theta: the lag for each unit of coupling that moving hands need (science 3.8) [s].

    A device that may damp needs less, and none in a loosely coupled room.

    Args:
        damping_budget: Largest damping that the room's weakest device may render, Colgate's bound
            [N s/m].
        coupling: m.
    """
    damped = min(1.0, max(0.0, damping_budget) / FULL_BUDGET)
    loose, tight = TIGHT
    share = min(1.0, max(0.0, (coupling - loose) / (tight - loose)))
    return (1.0 - damped) * HAND_TIME + damped * share * DAMPED_HAND_TIME


def choose_lag(coupling: float, longest_delay: float, damping_budget: float) -> RoomLag:
    """The lag of a room: that for hands at rest with a margin, or for moving hands if that is more.

    Args:
        coupling: m.
        longest_delay: T_max [s].
        damping_budget: Damping budget of the room's weakest device [N s/m].
    """
    needed = lag_needed(coupling, longest_delay)
    lag = max(needed / SHARE, hand_time(damping_budget, coupling) * coupling)
    return RoomLag(lag, coupling, margin(coupling, longest_delay, lag))


def margin(coupling: float, longest_delay: float, lag: float) -> float:
    """Distance of a room with this lag from the theorem's edge; above 1 it is stable.

    Args:
        coupling: m.
        longest_delay: T_max [s].
        lag: tau [s].
    """
    needed = lag_needed(coupling, longest_delay)
    if needed > 0.0:
        return lag / needed
    return 1.0 / coupling if coupling > EXACT else math.inf


def kept(lag: Lag, dt: float) -> Lag:
    """Share of the previous force that remains after a simulation period; 0 without a lag.

    It is the implicit step tau / (tau + dt), not e^(-dt / tau): a lag much shorter than the period
    would hardly be there with the latter, and a room of m just above 1 unstable at the theorem's
    lag. With the implicit step the theorem holds for sampled rooms as it stands (science 3.8).

    Args:
        lag: tau, one or one for each user [s].
        dt: Simulation period [s].
    """
    return lag / (lag + dt)
