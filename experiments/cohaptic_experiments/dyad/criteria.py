"""Two users whose hands move: how much lag keeps them stable, by five criteria.

A hand of mass M, damping b and stiffness k holds its tip against a contact of gain K. Its loop from
surface to force is that of a held hand times H(s) = (M s^2 + b s + k) / (M s^2 + b s + k + K). With
the coupling c = S_12, the room's lag tau and T the sum of both loop delays, two users have

    (1 + s tau)^2 = c^2 H_1(s) H_2(s) e^(-s T).

Only the sum of the delays counts, whatever their ratio. How large tau must be, say

- `by_roots`, exactly: the rightmost root, by Chebyshev collocation as in `room_roots`;
- `by_crossings`: the least delay that puts a root on the axis, found where |c^2 H_1 H_2| and
  |1 + i w tau|^2 cross. With it Du, Kulkarni, Kager and Campolo 2025 (Stability criteria and motor
  performance in delayed haptic dyadic interactions mediated by robots, arXiv:2510.14511) bound the
  delay of two people whom a spring couples;
- `at_any_delay`: where they do not cross, no delay does harm: their delay-independent criterion;
- `by_small_gain`: for all delays up to T by the small gain theorem about the loop without delay,
  with |e^(-i w T) - 1| at its largest (Gu, Kharitonov and Chen 2003, Stability of Time-Delay
  Systems, chapter 3);
- `by_rule`: tau >= theta c with theta = M / b, our own (science 3.8), for any delay.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from cohaptic.control.stability.room_roots import chebyshev
from cohaptic_server.numeric import Floats

Complexes = npt.NDArray[np.complex128]
SHORTEST, LONGEST, SCANNED = 1e-3, 1.0, 24  # range of lags [s], and how many of them are tried
W: Floats = np.geomspace(0.05, 2000.0, 8000)  # 1/s, from below to above all modes of two hands


@dataclass(frozen=True, slots=True)
class Hand:
    """A hand and the contact that it presses on.

    Args:
        mass: M [kg].
        damping: b [N s/m].
        stiffness: k [N/m].
        gain: K [N/m].
    """

    mass: float
    damping: float
    stiffness: float
    gain: float

    @property
    def time(self) -> float:
        """theta = M / b [s]."""
        return self.mass / self.damping

    def loop(self) -> Complexes:
        """H at the frequencies W."""
        own = self.stiffness - self.mass * W * W + 1j * self.damping * W
        return np.asarray(own / (own + self.gain))


@dataclass(frozen=True, slots=True)
class Dyad:
    """Two users.

    Args:
        hands: Mechanics of both.
        coupling: c, below 1.
        delays: Loop delay of each, above 0 [s].
    """

    hands: tuple[Hand, Hand]
    coupling: float
    delays: tuple[float, float]

    def gain(self) -> Complexes:
        """c^2 H_1 H_2 at the frequencies W."""
        first, second = self.hands
        return np.asarray(self.coupling**2 * first.loop() * second.loop())


def by_rule(dyad: Dyad) -> float:
    """theta c, with theta of the hand that damps least for its mass [s]."""
    return dyad.coupling * max(hand.time for hand in dyad.hands)


def at_any_delay(dyad: Dyad) -> float:
    """Least lag with |c^2 H_1 H_2| < |1 + i w tau|^2 at every frequency [s]."""
    return math.sqrt(max(0.0, float(((np.abs(dyad.gain()) - 1.0) / W**2).max())))


def by_roots(dyad: Dyad) -> float:
    """Lag above which no root is unstable [s]."""
    return least(lambda lag: rightmost(dyad, lag) < 0.0)


def by_crossings(dyad: Dyad) -> float:
    """Lag above which both delays are below the first that puts a root on the axis [s]."""
    gain, T = dyad.gain(), sum(dyad.delays)

    def stable(lag: float) -> bool:
        return without_delay(dyad, lag) and first_crossing(gain / (1.0 + 1j * W * lag) ** 2) > T

    return least(stable)


def by_small_gain(dyad: Dyad) -> float:
    """Lag above which all delays up to the given ones are stable, by small gain [s]."""
    gain, T = dyad.gain(), sum(dyad.delays)
    change = 2.0 * np.sin(0.5 * np.minimum(W * T, np.pi))

    def stable(lag: float) -> bool:
        loop = gain / (1.0 + 1j * W * lag) ** 2
        return without_delay(dyad, lag) and bool((np.abs(loop / (1.0 - loop)) * change < 1.0).all())

    return least(stable)


def least(stable: Callable[[float], bool]) -> float:
    """Lag above which every lag that was tried is stable; 0 if all are [s]."""
    good = bad = LONGEST
    for bad in np.geomspace(LONGEST, SHORTEST, SCANNED).tolist():
        if not stable(bad):
            break
        good = bad
    else:
        return 0.0
    while good > 1.003 * bad:
        middle = math.sqrt(good * bad)
        good, bad = (middle, bad) if stable(middle) else (good, middle)
    return good


def first_crossing(loop: Complexes) -> float:
    """Least T for which loop e^(-i w T) = 1 at some frequency of W; inf if none [s]."""
    size = np.log(np.abs(loop))
    (at,) = np.nonzero(size[:-1] * size[1:] < 0.0)
    if not at.size:
        return math.inf
    fraction = size[at] / (size[at] - size[at + 1])
    w = W[at] + fraction * (W[at + 1] - W[at])
    phase = np.unwrap(np.angle(loop))
    angle = phase[at] + fraction * (phase[at + 1] - phase[at])
    return float((np.mod(angle, 2.0 * np.pi) / w).min())


def stiffest_spring(hands: tuple[Hand, Hand]) -> float:
    """Largest spring between two free hands that bears any delay, by zero crossings [N/m].

    The dyad of Du et al. 2025: (M_1 s^2 + b_1 s + k)(M_2 s^2 + b_2 s + k) = k^2 e^(-s T). For hands
    that are not too unlike it is (b_1^2 + b_2^2) / (2 (M_1 + M_2)), where low frequencies decide.
    """
    low, high = 0.0, 1e6
    while high - low > 1e-6 * high:
        k = 0.5 * (low + high)
        own = [k - h.mass * W * W + 1j * h.damping * W for h in hands]
        crosses = bool((np.abs(own[0] * own[1]) < (1.0 - 1e-12) * k * k).any())
        low, high = (low, k) if crosses else (k, high)
    return low


def without_delay(dyad: Dyad, lag: float) -> bool:
    """Whether the roots without any delay are stable."""
    return float(np.linalg.eigvals(generator(dyad, lag, (0, 0))).real.max()) < 0.0


def rightmost(dyad: Dyad, lag: float) -> float:
    """Real part of the rightmost root [1/s]."""
    fast = W[np.abs(dyad.gain()) >= 1.0]  # no unstable root is faster than where the gain ends
    top = float(fast.max()) if fast.size else 0.0
    first, second = (math.ceil(12 + 0.75 * top * T) for T in dyad.delays)
    return float(np.linalg.eigvals(generator(dyad, lag, (first, second))).real.max())


def generator(dyad: Dyad, lag: float, points: tuple[int, int]) -> Floats:
    """The room with so many points for each delay, 0 for none.

    State: of each user lagged force, tip and its velocity, then the forces in the delays.
    """
    A = np.zeros((6 + sum(points),) * 2)
    start = 6
    for i, (hand, T, count) in enumerate(zip(dyad.hands, dyad.delays, points, strict=True)):
        y, x, v, other = 3 * i, 3 * i + 1, 3 * i + 2, 3 * (1 - i)
        end = other
        if count:
            D = (2.0 / T) * chebyshev(count)
            A[start : start + count, start : start + count] = D[1:, 1:]
            A[start : start + count, other] = D[1:, 0]
            start += count
            end = start - 1
        pressed = np.zeros(len(A))  # x - c y_j(t - T), in units that make both contacts alike
        pressed[x], pressed[end] = 1.0, -dyad.coupling
        A[y] = pressed / lag
        A[y, y] -= 1.0 / lag
        A[x, v] = 1.0
        A[v] = -hand.gain / hand.mass * pressed
        A[v, x] -= hand.stiffness / hand.mass
        A[v, v] -= hand.damping / hand.mass
    return A
