"""Intentions of hands that probe a session: they rest pressed in, and one sways or presses on."""

from __future__ import annotations

import math
from dataclasses import dataclass

from cohaptic.simulated.hand import Intention, ease
from cohaptic.vec import Vec3, add, scale

_RISE = 0.5  # s in which a sway grows to its full size


@dataclass(frozen=True, slots=True)
class Wave:
    """One sine of a sway.

    Args:
        frequency: Frequency [Hz].
        amplitude: Amplitude [m].
        phase: Phase at the start of the sway [rad].
    """

    frequency: float
    amplitude: float
    phase: float = 0.0


@dataclass(frozen=True, slots=True)
class Probing(Intention):
    """Intention that approaches, rests at its depth, and then sways or presses deeper.

    Args:
        at_time: Time at which the sway or the further press begins [s].
        sway: Sines by which the intended depth sways.
        further: Depth of the further press [m].
        within: Duration of the further press [s].
    """

    at_time: float = math.inf
    sway: tuple[Wave, ...] = ()
    further: float = 0.0
    within: float = 0.02

    def position(self, t: float) -> Vec3:
        """Return the intended position [m] of the tip at the time `t` [s]."""
        # Dataclasses with slots are made anew, so that `super()` without arguments does not work.
        tip = Intention.position(self, t)
        since = t - self.at_time
        if since <= 0.0:
            return tip
        deeper = self.further * ease(since / self.within)
        deeper += ease(since / _RISE) * sum(
            w.amplitude * math.sin(2.0 * math.pi * w.frequency * since + w.phase) for w in self.sway
        )
        return add(tip, scale(self.direction, deeper))


def rich_sway(frequencies: tuple[float, ...], fastest: float) -> tuple[Wave, ...]:
    """Return sines of equal peak velocity, with phases that keep their sum small.

    Args:
        frequencies: Frequencies [Hz].
        fastest: Peak velocity of each sine [m/s].
    """
    return tuple(
        # Phases that grow with the square of the number spread the peaks (Schroeder 1970).
        Wave(f, fastest / (2.0 * math.pi * f), math.pi * i * i / len(frequencies))
        for i, f in enumerate(frequencies)
    )
