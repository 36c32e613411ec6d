"""Growth rate of a room of hands held still: the rightmost root of its characteristic equation.

With the coupling matrix S of science 3.8, the loop delay T_i of row i and the room's lag tau, the
roots s are those of

    det(I (1 + s tau) + diag(e^(-s T_i)) S) = 0,    or    tau y_i' = -y_i - (S y)_i(t - T_i).

With a lag this is a delay differential equation. The module discretises the equation's generator by
Chebyshev collocation (Breda, Maset and Vermiglio 2005, Pseudospectral differencing methods for
characteristic roots of delay differential equations, SIAM J. Sci. Comput. 27), each delay on a grid
of its own. It then refines the rightmost eigenvalues on the equation itself by successive linear
problems (Ruhe 1973, Algorithms for the nonlinear eigenvalue problem, SIAM J. Numer. Anal. 10).

Without a lag this is a difference equation, whose rightmost root may jump at an arbitrarily small
change of a delay (Hale and Verduyn Lunel 2002, Strong stabilization of neutral functional
differential equations, IMA J. Math. Control Inform. 19). The growth rate is therefore the supremum
over delays close to the given ones, which has a closed form for a symmetric S. A root s = a + i w
requires an eigenvalue -1 of D E S E, where E = diag(e^(-a T_i / 2)) and the diagonal matrix D has
the phases e^(-i w T_i). The moduli of these eigenvalues are at most the spectral radius rho(E S E),
and for delays close to the given ones some w makes all phases equal. So the supremum is the a with
rho(E S E) = 1: ln(m) / T for equal delays T, and negative iff m = rho(S) < 1.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

from cohaptic.control.stability.single_contact import Floats

# Points of a delay's grid: a constant number for smooth solutions, and more for each radian of
# phase over the delay. This gives 4.7 points per wavelength; Chebyshev collocation needs pi.
BASE, PER_RADIAN = 8, 0.75
LARGEST = 1200  # limit of a discretised room's unknowns; its eigenvalues take about two seconds
# Most eigenvalues that are refined, from the right; the rightmost root is among them
# (test_room_roots.py).
CANDIDATES = 8
# Ratio to the longest time constant below which a delay needs no grid: it moves a root by as small
# a part. Reasoned, not measured.
SMALL = 1e-6


def growth(S: Floats, delays: Floats, lag: float) -> float:
    """Return the growth rate of a room's fastest growing motion; the room is stable iff it is < 0.

    The growth rate is the real part of the rightmost root; without a lag it is the supremum over
    delays close to the given ones. With a lag much shorter than the delays (below about
    m T_max / 200 for 8 users, m T_max / 13 for 64, for the spectral radius m of S and the longest
    delay T_max) the discretised room would be too large; the result is then `largest_growth`.

    Args:
        S: Coupling matrix, symmetric, shape (n, n) (`lag_choice.coupling_matrix`).
        delays: Loop delay T_i of each row, at least 0, shape (n,) [s].
        lag: Lag tau, 0 for none [s].

    Returns:
        Growth rate [1/s]; -inf if there is no root, as for uncoupled users without a lag; inf if
        there is neither a lag nor any delay and m >= 1.
    """
    longest = float(delays.max(initial=0.0))
    # No unstable root has a higher frequency than this.
    frequency = max(fastest(S, delays, lag, 0.0), 3.0 / longest if longest > 0.0 else 0.0)
    size, best = 0.0, -math.inf
    while lag > 0.0 and size < unknowns(delays, lag, frequency) <= LARGEST:
        size = unknowns(delays, lag, frequency)
        for guess in rightmost(S, delays, lag, frequency):
            if guess.real < best - 0.05 / (longest + lag):
                break  # resolved eigenvalues are nearer than that to their roots
            best = max(best, refined(S, delays, lag, guess))
        # No root to the right of the best one has a higher frequency than this.
        frequency = min(fastest(S, delays, lag, best), 3.0 * frequency)
    return best if best > -math.inf else largest_growth(S, delays, lag)


def largest_growth(S: Floats, delays: Floats, lag: float) -> float:
    """Return an upper bound of `growth` [1/s], which is exact without a lag.

    The bound is the number a at which `scaled_radius` equals 1 + a tau.

    Args:
        S: Coupling matrix, symmetric, shape (n, n).
        delays: Loop delay T_i of each row, shape (n,) [s].
        lag: Lag tau [s].
    """

    def above(a: float) -> bool:
        return scaled_radius(S, delays, a) < 1.0 + a * lag

    side = above(0.0)
    longest = max(float(delays.max(initial=0.0)), lag)
    if longest == 0.0:
        return -math.inf if side else math.inf
    unit = 1.0 / longest
    near, far = 0.0, -unit if side else unit
    while above(far) is side:
        near, far = far, 2.0 * far
        if abs(far) > 1e12 * unit:
            return math.copysign(math.inf, far)
    low, high = min(near, far), max(near, far)
    while high - low > 1e-14 * unit + 1e-14 * abs(high):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if above(middle) else (middle, high)
    return high


def scaled_radius(S: Floats, delays: Floats, a: float) -> float:
    """Return the spectral radius of E S E with E = diag(e^(-a T_i / 2)).

    For a root s with the real part a and the lag tau it is an upper bound of |1 + s tau|.

    Args:
        S: Coupling matrix, symmetric, shape (n, n).
        delays: Loop delay T_i of each row, shape (n,) [s].
        a: Real part of a root [1/s].
    """
    E = np.exp(np.clip(-0.5 * a * delays, -300.0, 300.0))
    return float(np.abs(np.linalg.eigvalsh(E[:, None] * S * E)).max(initial=0.0))


def fastest(S: Floats, delays: Floats, lag: float, a: float) -> float:
    """Return an upper bound of |Im s| for roots s with Re s >= a [1/s]; inf without a lag."""
    if lag <= 0.0 or a == -math.inf:
        return math.inf
    radius, real = scaled_radius(S, delays, a), max(0.0, 1.0 + a * lag)
    return math.sqrt(max(0.0, radius * radius - real * real)) / lag


def points(delays: Floats, lag: float, frequency: float) -> list[int]:
    """Return the number of grid points for each delay without the first, 0 if it is negligible.

    Args:
        delays: Loop delays, shape (n,) [s].
        lag: Lag of the room [s].
        frequency: Largest frequency that the grids must resolve [rad/s].
    """
    negligible = SMALL * max(lag, float(delays.max(initial=0.0)))
    return [
        math.ceil(BASE + PER_RADIAN * frequency * T) if T > negligible else 0
        for T in delays.tolist()
    ]


def unknowns(delays: Floats, lag: float, frequency: float) -> float:
    """Return the number of unknowns of the discretised room; inf for an infinite frequency."""
    if frequency == math.inf:
        return math.inf
    return len(delays) + sum(points(delays, lag, frequency))


def rightmost(S: Floats, delays: Floats, lag: float, frequency: float) -> list[complex]:
    """Return the rightmost eigenvalues s with Im s >= 0 of the discretised room [1/s].

    The rightmost comes first. The room's state consists of the lagged forces y and, for each delay,
    the values of (S y)_i on the grid from the entrance to the exit of the delay.
    """
    n = len(S)
    counts = points(delays, lag, frequency)
    A = np.zeros((n + sum(counts),) * 2)
    A[:n, :n] = -np.eye(n) / lag
    start = n
    for i, (T, count) in enumerate(zip(delays.tolist(), counts, strict=True)):
        if count == 0:
            A[i, :n] -= S[i] / lag
            continue
        D = (2.0 / T) * chebyshev(count)
        way = slice(start, start + count)
        A[way, way] = D[1:, 1:]
        A[way, :n] = D[1:, :1] * S[i]
        A[i, start + count - 1] = -1.0 / lag
        start += count
    roots = np.linalg.eigvals(A)
    roots = roots[roots.imag >= 0.0]
    return list(map(complex, roots[np.argsort(-roots.real)][:CANDIDATES]))


@lru_cache(maxsize=256)
def chebyshev(count: int) -> Floats:
    """Return the Chebyshev differentiation matrix for `count` + 1 points.

    The points are cos(k pi / count), k = 0 to count, and the formula is that of Trefethen 2000,
    p. 54.
    """
    k = np.arange(count + 1)
    x = np.cos(np.pi * k / count)
    c = np.where((k == 0) | (k == count), 2.0, 1.0) * (-1.0) ** k
    D = np.outer(c, 1.0 / c) / (x[:, None] - x + np.eye(count + 1))
    return np.asarray(D - np.diag(D.sum(axis=1)))


def refined(S: Floats, delays: Floats, lag: float, guess: complex) -> float:
    """Return the real part of the root next to the eigenvalue `guess` [1/s]; -inf without one."""
    s, eye = guess, np.eye(len(S))
    for _ in range(20):
        passed = np.exp(-s * delays)[:, None]
        M = (1.0 + s * lag) * eye + passed * S
        slope = lag * eye - delays[:, None] * passed * S
        try:
            # The next s has det(M + (s' - s) slope) = 0.
            inverse = np.linalg.eigvals(np.linalg.solve(M, slope))
        except np.linalg.LinAlgError:
            return s.real  # M is singular: s is exactly a root
        step = -1.0 / complex(inverse[np.argmax(np.abs(inverse))])
        s += step
        if abs(s - guess) > 0.2 * (abs(guess) + 1.0 / (lag + float(delays.max()))):
            break
        if abs(step) < 1e-12 * (abs(s) + 1.0 / lag):
            return s.real
    return -math.inf
