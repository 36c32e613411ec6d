"""Transparency over frequency: another's sway as it is felt, and one's own object beside others.

The tip of the first hand is clamped and sways by eleven sines at once; all other hands rest. The
response at each sine is that of the force on a hand to the depth of the first tip. It is divided by
the same response of the same hands without a network (`at_once`), so that the ratio is 1 where the
network takes nothing away, for another's hand as for one's own object.
"""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass

import numpy as np

from cohaptic_experiments.transparency.motion import rich_sway
from cohaptic_experiments.transparency.scheme import AnyScheme
from cohaptic_experiments.transparency.setting import Setting
from cohaptic_experiments.virtual_session import PERIOD
from cohaptic_server.numeric import Complex, Floats

FREQUENCIES = (0.1, 0.2, 0.5, 1.0, 2.0, 3.0, 5.0, 7.0, 10.0, 14.0, 20.0)  # Hz
GENTLE = 0.8e-3  # m/s; peak velocity of each sine, of a hand that sways by 1 mm at 0.1 Hz
WINDOW = 10.0  # s; whole periods of every frequency
_SETTLE = 1.0  # s from the start of the sway to the window
_LEAD = 0.1  # turns; a larger lead at the lowest frequency counts as a delay
HALF_POWER = math.sqrt(0.5)  # amplitude at -3 dB


@dataclass(frozen=True, eq=False)
class Responses:
    """Responses of the forces to the depth of the first tip, at f frequencies.

    Args:
        others: Response of each other hand, shape (users - 1, f) [N/m].
        own: Response of the first hand, shape (f,) [N/m].
        explained_variance: Least share of another hand's variance that the sines explain.
    """

    others: Complex
    own: Complex
    explained_variance: float


@dataclass(frozen=True, eq=False)
class Transparency:
    """Responses divided by those without a network, at f frequencies.

    Args:
        frequencies: Frequencies, rising, shape (f,) [Hz].
        others: Ratio of each other hand, shape (users - 1, f).
        own: Ratio of the first hand, shape (f,).
        explained_variance: Least share of another hand's variance that the sines explain. Far
            below 1 the coupling is not linear or not at rest, and ratios say nothing.
    """

    frequencies: Floats
    others: Complex
    own: Complex
    explained_variance: float

    @property
    def weakest(self) -> Floats:
        """Least amplitude of any other hand, shape (f,)."""
        return np.asarray(np.abs(self.others).min(axis=0))

    @property
    def strongest(self) -> float:
        """Largest amplitude of any other hand at any frequency."""
        return float(np.abs(self.others).max())

    @property
    def delays(self) -> Floats:
        """Phase of the slowest other hand as a delay at each frequency, shape (f,) [s]."""
        return np.asarray(
            np.array([as_delays(self.frequencies, z) for z in self.others]).max(axis=0)
        )

    @property
    def bandwidth(self) -> float:
        """Frequency from which on the weakest other hand is below -3 dB [Hz]; inf if it is not."""
        return falls_below(self.frequencies, self.weakest, HALF_POWER)


def as_delays(frequencies: Floats, response: Complex) -> Floats:
    """Return the phase of a response as a delay at each frequency, shape (f,) [s].

    A phase is known up to whole turns. At the first frequency it counts as the least delay, or as a
    small lead; at each further one as the delay that is nearest to that of the frequency before.

    Args:
        frequencies: Frequencies, rising, shape (f,) [Hz].
        response: Response at each, shape (f,).
    """
    delays: list[float] = []
    for f, z in zip(frequencies.tolist(), response.tolist(), strict=True):
        turns = -cmath.phase(z) / (2.0 * math.pi)
        if delays:
            turns += round(delays[-1] * f - turns)
        else:
            turns += turns < -_LEAD  # a small lead is none of a turn's delay
        delays.append(turns / f)
    return np.array(delays)


def falls_below(frequencies: Floats, amplitude: Floats, limit: float) -> float:
    """Return the first frequency at which an amplitude falls below a limit [Hz].

    Between the measured frequencies both are interpolated on logarithmic scales. The result is inf
    if the amplitude stays above the limit, and the first frequency if it begins below.

    Args:
        frequencies: Frequencies, rising, shape (f,) [Hz].
        amplitude: Amplitude at each, shape (f,).
        limit: Limit of the amplitude.
    """
    below = np.flatnonzero(amplitude < limit)
    if not len(below):
        return math.inf
    i = int(below[0])
    if i == 0:
        return float(frequencies[0])
    x, y = np.log(frequencies[i - 1 : i + 1]), np.log(np.maximum(amplitude[i - 1 : i + 1], 1e-12))
    fraction = (math.log(limit) - y[0]) / (y[1] - y[0])
    return float(math.exp(x[0] + fraction * (x[1] - x[0])))


def measure(
    setting: Setting, scheme: AnyScheme, truth: Responses, fastest: float = GENTLE
) -> Transparency:
    """Measure a scheme over frequency, against the truth of the same setting.

    Args:
        setting: Hands, body and link.
        scheme: Way of coupling, which has not been used yet.
        truth: Responses without a network, from `true_responses`.
        fastest: Peak velocity of each sine [m/s].
    """
    plans = setting.intentions(rich_sway(FREQUENCIES, fastest))
    begin = setting.rests_at + _SETTLE + 4.0 * setting.link.delay
    tips, forces = setting.play(scheme, plans, begin + WINDOW, clamped=True)
    found = _responses(setting, tips, forces)
    others, own = found.others / truth.others, found.own / truth.own
    return Transparency(np.array(FREQUENCIES), others, own, found.explained_variance)


def true_responses(setting: Setting, fastest: float = GENTLE) -> Responses:
    """Return the responses of the same hands without a network, whatever the setting's link."""
    setting = setting.without_network()
    plans = setting.intentions(rich_sway(FREQUENCIES, fastest))
    motion = setting.truth(plans, setting.rests_at + _SETTLE + WINDOW, clamped=True)
    return _responses(setting, motion.tips, motion.force)


def _responses(setting: Setting, tips: Floats, forces: Floats) -> Responses:
    n = round(WINDOW / PERIOD)
    inward = np.array(setting.intentions()[0].direction)
    depth, felt = _at_frequencies(inward @ tips[0, :, -n:]), _at_frequencies(forces[:, -n:])
    explained_variance = 0.5 * (np.abs(felt[1:]) ** 2).sum(axis=1) / forces[1:, -n:].var(axis=1)
    ratios = felt / depth
    return Responses(ratios[1:], ratios[0], float(explained_variance.min()))


def _at_frequencies(values: Floats) -> Complex:
    """Return the component of values over a window at each frequency, shape (..., f)."""
    t: Floats = PERIOD * np.arange(values.shape[-1], dtype=np.float64)
    waves = np.exp(-2j * math.pi * np.outer(t, FREQUENCIES))
    level = values - values.mean(axis=-1, keepdims=True)
    return np.asarray(2.0 * (level @ waves) / len(t))
