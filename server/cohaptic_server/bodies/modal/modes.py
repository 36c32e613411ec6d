"""The lowest natural modes of a body, as displacements of its surface."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cohaptic.errors import SettingError
from cohaptic_server.numeric import Floats
from cohaptic_server.touchable import DAMPING_RATIO

# Highest frequency of a mode. Above it even the unsteadiest hand excites no mode, and ticks at
# 60 Hz have at most six samples per period: to a hand the body is at rest at once.
HIGHEST = 10.0  # Hz
MOST = 6  # modes; each adds a displacement field that every tick evaluates


@dataclass(frozen=True, eq=False)
class Modes:
    """The k natural modes of a body on the n vertices of its surface.

    Args:
        frequency: Natural angular frequencies without damping, shape (k,) [rad/s].
        shapes: Shape of each mode, shape (k, n, 3) [sqrt(m/N)]. A force f on a vertex gives a mode
            the static amplitude g = shapes . f [sqrt(N m)], which moves the surface by shapes g
            [m]. So shapes' shapes is the mode's part of the compliance; its energy is g^2 / 2.
        damping: Damping ratio of every mode, as a share of critical damping.

    Raises:
        SettingError: The damping is out of range.
    """

    frequency: Floats
    shapes: Floats
    damping: float = DAMPING_RATIO

    def __post_init__(self) -> None:
        check_damping_ratio(self.damping)
        if self.shapes.shape[:1] != self.frequency.shape or not (self.frequency > 0.0).all():
            raise ValueError(f"shapes {self.shapes.shape} of frequencies {self.frequency}")

    def __len__(self) -> int:
        return len(self.frequency)


def check_damping_ratio(damping: float) -> None:
    """Refuse a damping ratio outside of the range of the oscillator model.

    Raises:
        SettingError: The ratio is below 0.02, where a swing outlasts a visit, or above 0.95, where
            a mode does not swing and `--relaxation` describes it better.
    """
    if not 0.02 <= damping <= 0.95:
        raise SettingError("--damping-ratio", damping, "from 0.02 to 0.95 of critical damping")


def step_of(frequency: Floats, damping: float, dt: float) -> Floats:
    """Matrix that advances each mode's deviation from its static amplitude by one tick.

    The matrix is the exact free motion of e'' + 2 zeta w e' + w^2 e = 0 in the coordinates
    (e, e' / w).

    Args:
        frequency: Angular frequency w of each mode, shape (k,) [rad/s].
        damping: Damping ratio zeta, below 1.
        dt: Simulation period N T [s].

    Returns:
        Shape (k, 2, 2).
    """
    root = np.sqrt(1.0 - damping * damping)
    angle = frequency * (root * dt)
    decay = np.exp(-damping * frequency * dt)
    cos, sin = decay * np.cos(angle), decay * np.sin(angle) / root
    return np.array([[cos + damping * sin, sin], [-sin, cos - damping * sin]]).transpose(2, 0, 1)


def swing_of(frequency: Floats, damping: float, dt: float, at: Floats) -> Floats:
    """Swing of each mode about its static amplitude, relative to that amplitude: |D(z) - 1|.

    D(z) is the ratio of the mode's amplitude to the static one, for a force that is constant over
    each tick, including the tick in which it is applied.

    Args:
        frequency: Angular frequency of each mode, shape (k,) [rad/s].
        damping: Damping ratio.
        dt: Simulation period N T [s].
        at: Angular frequencies of the force up to the Nyquist frequency, shape (p,) [rad/s].

    Returns:
        Shape (k, p).
    """
    step = step_of(frequency, damping, dt)
    z = np.exp(-1j * at * dt)  # transfer function of a delay by one tick
    trace = step[:, 0, 0] + step[:, 1, 1]
    det = step[:, 0, 0] * step[:, 1, 1] - step[:, 0, 1] * step[:, 1, 0]
    # First entry of (1 - step z)^-1 step.
    over = step[:, :1, 0] - det[:, None] * z
    under = 1.0 - trace[:, None] * z + det[:, None] * (z * z)
    return np.asarray(np.abs(over / under * (1.0 - z)))
