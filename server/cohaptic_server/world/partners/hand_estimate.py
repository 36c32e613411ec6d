"""A hand's mass, damping and stiffness, from its tip and the force on it while it does as it likes.

m x'' + b x' + k x + f = k i holds with the depth x, the force f against it and the intention i,
which is unknown. Multiplied by a window times a wave and integrated by parts, it becomes one
complex number r for each frequency, without any derivative of a measured value (modulating
functions, Shinbrot 1957).

Voluntary motion is in r. Where the contact answers the own motion with f = K x + p, a least square
of r is small for Z = -K whatever the hand: the answer is in f. The likelihood of x is

    prod 1 / (s^2 + |x + p / (Z + K)|^2) = prod 1 / (s^2 + |x r / (r - p)|^2),    p = f - K x,

with K known from the other hands' models, s the motion of an unquiet hand, and a scale of the
intention at each frequency that nobody knows. Own motion alone then says nothing; motion that
others, or a swing, cause at some frequencies says what Z is there. A cloud of hands carries the
likelihood on from window to window, and drifts, so that it forgets.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from cohaptic_server.numeric import Complex, Floats

GRID = 0.01  # s between two values of a window: five in a period of the fastest of `BANDS`
# s; two periods of the slowest of `BANDS`. A longer one would learn of a hand later. Reasoned, not
# measured, as are the numbers below that name no source.
WINDOW = 2.0
STEP = 1.0  # s from one window to the next; half of one, as usual with Hann's window (Welch 1967)
# Hz; whole periods in a window, so that a rest has no part in it. Up to a third of 60 samples a
# second.
BANDS = np.arange(1.0, 20.01, 0.5)
# Ends of a cloud: a hand on a light device to an arm on a heavy one.
LEAST, LARGEST = np.array([0.03, 0.5, 50.0]), np.array([0.8, 20.0, 1500.0])
# Middle of the cloud that knows nothing; less damped than the hand that models begin with, since
# weak damping is what has to be found.
USUAL = np.array([0.15, 5.0, 400.0])
_SPREAD = 0.7  # of the logarithms of the cloud that knows nothing: a factor of two
_WEIGHT = 0.4  # windows overlap, and neighbouring frequencies of a window do
_ROUNDS = 4  # in which a window's likelihood is taken in, so that a cloud can follow
_DRIFT = 0.02  # of the logarithms between two windows: a fifth in a hundred
# Liu and West (2001): a cloud that is drawn anew keeps its mean and its spread. They take 0.974 to
# 0.995 (discounts of 0.95 to 0.99).
_KEEP = 0.98
# m, unexplained motion of a hand at rest: of its intention at 1 Hz, falling with the frequency,
# and of its sensors. It is the same for all hands, so that a hand that hardly moves says nothing.
_UNQUIET, _SENSED = 30e-6, 3e-6


def _waves() -> tuple[Complex, Complex, Complex]:
    n = round(WINDOW / GRID)
    t, w = GRID * np.arange(n)[:, None], 2.0 * np.pi * BANDS
    a = 2.0 * np.pi / WINDOW
    # Hann's window, so that its first derivative is zero at both ends as the window is.
    hann, d, dd = 1.0 + 0.0j - np.cos(a * t), a * np.sin(a * t), a**2 * np.cos(a * t)
    wave = 2.0 / n * np.exp(-1j * w * t)
    return (hann * wave, -(d - 1j * w * hann) * wave, (dd - 2j * w * d - w**2 * hann) * wave)


_WAVES = _waves()


@dataclass(frozen=True, eq=False)
class Seen:
    """One window of h hands: X_i stands for the i-th derivative of the depth; shapes (h, f)."""

    position: Complex
    velocity: Complex
    acceleration: Complex
    force: Complex

    def intended(self, hands: Floats) -> Complex:
        """Return r, the intention's force, if the hands were these (h, p, 3); (h, p, f) [N]."""
        m, b, k = (hands[..., i, None] for i in range(3))
        x, v, a, f = (
            part[:, None] for part in (self.position, self.velocity, self.acceleration, self.force)
        )
        # (3.15) r = m X_2 + b X_1 + k X_0 + F
        return np.asarray(m * a + b * v + k * x + f)


def on_grid(times: Floats, values: Floats) -> Floats:
    """Return values at the instants of the last window.

    The curve is cubic: samples are not quite evenly spaced, and lines between them would make
    motion at other frequencies of it.

    Args:
        times: Times of k samples, rising, over more than a window, shape (k,) [s].
        values: Values at these times, shape (k, c).

    Returns:
        Shape (c, WINDOW / GRID).
    """
    n = round(WINDOW / GRID)
    at = times[-1] - GRID * np.arange(n, dtype=np.float64)[::-1]
    slopes = np.gradient(values, times, axis=0)
    before: npt.NDArray[np.int64] = np.asarray(np.searchsorted(times, at), dtype=np.int64) - 1
    i = np.minimum(np.maximum(before, 0), len(times) - 2)
    step = times[i + 1] - times[i]
    u = ((at - times[i]) / step)[:, None]
    # The cubic with these values and slopes at both ends (Hermite).
    a, b = values[i], values[i + 1]
    rise, c, d = b - a, step[:, None] * slopes[i], step[:, None] * slopes[i + 1]
    return np.asarray((a + u * (c + u * (3.0 * rise - 2.0 * c - d + u * (c + d - 2.0 * rise)))).T)


def seen(depth: Floats, force: Floats) -> Seen:
    """Return a window of depths [m] and forces [N], shape (h, WINDOW / GRID)."""
    x = depth - depth.mean(axis=1, keepdims=True)
    x0, x1, x2 = (_along(x, wave) for wave in _WAVES)
    return Seen(x0, x1, x2, _along(force - force.mean(axis=1, keepdims=True), _WAVES[0]))


def _along(values: Floats, wave: Complex) -> Complex:
    # Not as a product of matrices, whose threads wait for each other beside a busy program.
    return np.asarray((values[:, :, None] * wave).sum(axis=1))


@dataclass(frozen=True, eq=False, slots=True)
class Clouds:
    """Clouds of p hands for each of h hands.

    Args:
        log: Logarithms of the hands, shape (h, p, 3).
        seed: Seed of the draws.
        windows: Number of windows that were taken in.
    """

    log: Floats
    seed: int = 0
    windows: int = 0

    @classmethod
    def of(cls, hands: int, size: int = 256, seed: int = 0) -> Clouds:
        """Return clouds that know nothing: `size` hands for each of `hands`."""
        rng = np.random.default_rng((seed, 0))
        return cls(_bounded(np.log(USUAL) + _SPREAD * rng.standard_normal((hands, size, 3))), seed)

    @property
    def hands(self) -> Floats:
        """The clouds, shape (h, p, 3)."""
        return np.asarray(np.exp(self.log))

    @property
    def mean(self) -> Floats:
        """Geometric mean of the hands of each cloud, shape (h, 3)."""
        return np.asarray(np.exp(self.log.mean(axis=1)))

    @property
    def spread(self) -> Floats:
        """Standard deviation of the logarithms of each cloud, shape (h, 3)."""
        return np.asarray(self.log.std(axis=1))

    def after(self, window: Seen, contact: Complex) -> Clouds:
        """Return the clouds with one more window.

        Args:
            window: Depth and force of the h hands.
            contact: Stiffness K that each meets at its contact at `BANDS`, shape (h, f) [N/m].
        """
        rng = np.random.default_rng((self.seed, self.windows + 1))
        log = _bounded(self.log + _DRIFT * rng.standard_normal(self.log.shape))
        for _ in range(_ROUNDS):
            weight = _WEIGHT / _ROUNDS * _likelihood(np.exp(log), window, contact)
            fraction = np.exp(weight - weight.max(axis=1, keepdims=True))
            log = _drawn(log, fraction / fraction.sum(axis=1, keepdims=True), rng)
        return Clouds(log, self.seed, self.windows + 1)


def _drawn(log: Floats, fraction: Floats, rng: np.random.Generator) -> Floats:
    h, p, _ = log.shape
    # Systematic draws: each hand as often as its share says, up to one.
    index: npt.NDArray[np.int64] = np.empty((h, p), dtype=np.int64)
    for i in range(h):
        places = np.asarray((np.arange(float(p)) + rng.random()) / p, dtype=np.float64)
        index[i] = np.searchsorted(np.cumsum(fraction[i]), places)
    drawn = np.take_along_axis(log, np.minimum(index, p - 1)[..., None], axis=1)
    mean = drawn.mean(axis=1, keepdims=True)
    off = drawn - mean
    squares = np.einsum("hpi,hpj->hij", off, off) / p + 1e-6 * np.eye(3)
    spread = np.asarray(np.linalg.cholesky(squares), dtype=np.float64)
    noise = np.einsum("hij,hpj->hpi", spread, rng.standard_normal((h, p, 3)))
    return _bounded(mean + _KEEP * off + (1.0 - _KEEP**2) ** 0.5 * noise)


def _bounded(log: Floats) -> Floats:
    low, high = np.log(LEAST), np.log(LARGEST)
    # Reflected, so that no hand gathers at a bound.
    log = np.where(log < low, 2.0 * low - log, log)
    return np.asarray(np.clip(np.where(log > high, 2.0 * high - log, log), low, high))


def _likelihood(hands: Floats, window: Seen, contact: Complex) -> Floats:
    """Return the logarithm of the likelihood of each hand of each cloud, shape (h, p)."""
    r = window.intended(hands)
    # (Z + K) x as the window sees it, so that own motion alone says nothing however it changes.
    # (3.15) own = r - P, with P = F - K X_0
    own = r + contact[:, None] * window.position[:, None] - window.force[:, None]
    unexplained = window.position[:, None] * r / np.where(own == 0.0, 1.0, own)
    quiet = (_UNQUIET / BANDS) ** 2 + _SENSED**2
    # (3.15) prod over w of 1 / (sigma^2 + |X_0 r / (r - P)|^2), with sigma^2 = quiet; its logarithm
    return np.asarray(-np.log(quiet + np.abs(unexplained) ** 2).sum(axis=-1))
