"""The lowest natural modes of a body, as they are seen on its surface."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cohaptic.errors import SettingError
from cohaptic_server.numeric import Floats
from cohaptic_server.touchable import DAMPING_RATIO

# Above it the unsteadiest hand has nothing to excite a mode with, and a tick of 60 Hz has six
# samples of a period only: the body is at rest, for a hand, at once.
HIGHEST = 10.0  # Hz
MOST = 6  # modes; each adds a field of displacements to what a tick evaluates


@dataclass(frozen=True, eq=False)
class Modes:
    """Natural modes, k of them, on n vertices of a surface.

    Args:
        frequency: Natural angular frequencies, without damping, shape (k,) [rad/s].
        shapes: Shapes of each, shape (k, n, 3) [sqrt(m/N)]. A force f on a vertex has the static
            amplitude g = shapes . f [sqrt(N m)], of which the surface moves by shapes g [m]: so
            shapes' shapes is the mode's part of the compliance. Half of g squared is its energy.
        damping: Share of critical damping, of every mode.

    Raises:
        SettingError: The damping is out of its range.
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
    """Refuse a damping of modes that the oscillator is not made for.

    Raises:
        SettingError: It is not within 0.02 and 0.95. With less a swing outlasts a visit, with more
            it is no swing: `--relaxation` is for that.
    """
    if not 0.02 <= damping <= 0.95:
        raise SettingError("--damping-ratio", damping, "from 0.02 to 0.95 of critical damping")


def step_of(frequency: Floats, damping: float, dt: float) -> Floats:
    """What a tick makes of the deviation of each mode from its static amplitude.

    The free motion of e'' + 2 zeta w e' + w^2 e = 0, exactly, in the coordinates (e, e' / w).

    Args:
        frequency: w of each mode, shape (k,) [rad/s].
        damping: zeta, below 1.
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
    """|D(z) - 1| of each mode: how far it swings from where it would be at rest.

    D(z) is the mode's amplitude over the static one, with a force that is constant over each tick,
    the one in which it is applied included.

    Args:
        frequency: Frequency of each mode, shape (k,) [rad/s].
        damping: Share of critical damping.
        dt: Simulation period N T [s].
        at: Angular frequencies up to that of Nyquist, shape (p,) [rad/s].

    Returns:
        Shape (k, p).
    """
    step = step_of(frequency, damping, dt)
    z = np.exp(-1j * at * dt)  # of one tick of delay
    trace = step[:, 0, 0] + step[:, 1, 1]
    det = step[:, 0, 0] * step[:, 1, 1] - step[:, 0, 1] * step[:, 1, 0]
    # First entry of (1 - step z)^-1 step.
    over = step[:, :1, 0] - det[:, None] * z
    under = 1.0 - trace[:, None] * z + det[:, None] * (z * z)
    return np.asarray(np.abs(over / under * (1.0 - z)))
