"""Choose a room's lag: the time constant with which the object answers the forces (science 3.8).

Every hand feels the object's own stiffness, K_i = min(1 / C_ii, device limit). If the coupling is
so strong that the delayed forces of several hands would amplify each other, the forces f enter the
body through one first-order lag tau, the same for all: tau f~' = f - f~. The object then answers
other users' forces with some viscosity, and is never softer.

With the coupling matrix S_ij = K_i^(1/2) C_ij K_j^(1/2) off the diagonal, its spectral radius m and
the longest loop delay T_max of the room, hands held still are stable

    without a lag for m < 1,    otherwise for    tau > T_max sqrt(m^2 - 1) / arccos(-1 / m).

`docs/science.md` has the proof, for unequal delays; `room_roots.py` has the exact roots. Moving
hands need more: tau >= theta m, with theta at least a hand's mass over its damping. The damping
that a device may add reduces theta.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TypeVar

import numpy as np

from cohaptic.control.room_lag import RoomLag as RoomLag
from cohaptic.control.stability.single_contact import Floats

# Ratio of the theorem's least stable lag to the lag in use. The rest is a margin for delays that
# vary and hands that move. Reasoned, not measured.
FRACTION = 0.7
# theta for a device without a damping budget [s]: mass over damping of a heavy hand, 0.5 kg and
# 4 N s/m. Found with `cohaptic experiment hands`.
HAND_TIME = 0.12
FULL_BUDGET = 8.0  # N s/m; largest damping that the passivity layer renders (`MAX_DAMPING`)
# theta for a device with the full budget [s]: DAMPED_HAND_TIME for a coupling above the second
# value of TIGHT, 0 below the first value, linear in between. Both constants were found with
# `cohaptic experiment hands`; two hands on opposite sides of a balloon have a coupling of 0.65 and
# need no lag.
DAMPED_HAND_TIME = 0.06
TIGHT = (0.7, 0.75)
EXACT = 1e-9  # coupling below which hands count as uncoupled, far above rounding errors
Lag = TypeVar("Lag", float, Floats)


def coupling_matrix(C: Floats, stiffness: Sequence[Floats] | Floats) -> Floats:
    """Return the coupling matrix S of science 3.8: K^(1/2) C K^(1/2) with zero diagonal blocks.

    The stiffness K of a user with friction is a (3, 3) matrix. Any square root of that K will do,
    since a different one only turns S by an orthogonal matrix; the code uses the Cholesky factor.

    Args:
        C: Compliance of all contacts, user after user, shape (n, n) [m/N].
        stiffness: Stiffness K of each user, symmetric and positive, shape (1, 1) without or (3, 3)
            with friction [N/m]. The sizes add up to n.

    Returns:
        Coupling matrix, shape (n, n), symmetric, dimensionless.

    Raises:
        numpy.linalg.LinAlgError: A (3, 3) stiffness is not positive definite.
    """
    S = np.array(C, dtype=np.float64)
    if len(stiffness) == len(S):  # hands of one axis each: their square roots are numbers
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
    """Return the coupling m of a room: the spectral radius of S; 0 for an empty room.

    Args:
        S: Coupling matrix, symmetric, shape (n, n).
    """
    return float(np.abs(np.linalg.eigvalsh(S)).max()) if S.size else 0.0


def lag_needed(coupling: float, longest_delay: float) -> float:
    """Return the lag above which every room with this coupling is stable (theorem of 3.8) [s].

    This lag is 0 for couplings up to 1, continuous there, and exact for equal delays.

    Args:
        coupling: Coupling m of the room (`coupling_radius`).
        longest_delay: Longest loop delay T_max of the room, with sampling and the client's ramp
            between patches [s].
    """
    if coupling <= 1.0:
        return 0.0
    return longest_delay * math.sqrt(coupling * coupling - 1.0) / math.acos(-1.0 / coupling)


def hand_time(damping_budget: float, coupling: float) -> float:
    """Return theta, the lag per unit of coupling that moving hands need (science 3.8) [s].

    A damping budget reduces theta; with the full budget it is 0 below a coupling of `TIGHT[0]`.

    Args:
        damping_budget: Least damping budget of the room's devices: the damping that a device may
            render by Colgate's bound [N s/m].
        coupling: Coupling m of the room.
    """
    damped = min(1.0, max(0.0, damping_budget) / FULL_BUDGET)
    loose, tight = TIGHT
    fraction = min(1.0, max(0.0, (coupling - loose) / (tight - loose)))
    return (1.0 - damped) * HAND_TIME + damped * fraction * DAMPED_HAND_TIME


def choose_lag(coupling: float, longest_delay: float, damping_budget: float) -> RoomLag:
    """Choose a room's lag, long enough for hands at rest, with a margin, and for moving hands.

    Args:
        coupling: Coupling m of the room.
        longest_delay: Longest loop delay T_max of the room [s].
        damping_budget: Least damping budget of the room's devices [N s/m].
    """
    needed = lag_needed(coupling, longest_delay)
    lag = max(needed / FRACTION, hand_time(damping_budget, coupling) * coupling)
    return RoomLag(lag, coupling, margin(coupling, longest_delay, lag))


def margin(coupling: float, longest_delay: float, lag: float) -> float:
    """Return the stability margin of a room of hands held still, which is stable above 1.

    The margin is the lag over `lag_needed`, or 1 / m if no lag is needed.

    Args:
        coupling: Coupling m of the room; the margin is infinite if m is below `EXACT`.
        longest_delay: Longest loop delay T_max of the room [s].
        lag: Lag tau in use [s].
    """
    needed = lag_needed(coupling, longest_delay)
    if needed > 0.0:
        return lag / needed
    return 1.0 / coupling if coupling > EXACT else math.inf


def kept(lag: Lag, dt: float) -> Lag:
    """Return the weight of the previous force in one step of the lag; 0 without a lag.

    The weight is that of the implicit step, tau / (tau + dt). With e^(-dt / tau) a lag much shorter
    than the period would have hardly any effect, and a room whose coupling is just above 1 would be
    unstable at the theorem's lag. With the implicit step the theorem holds for sampled rooms (3.8).

    Args:
        lag: Lag tau of the room, or of each user [s].
        dt: Simulation period [s].
    """
    return lag / (lag + dt)
